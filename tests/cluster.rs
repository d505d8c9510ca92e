//! The job files in `examples/cluster` fly a sweep on real clusters, as far as these are installed.

use crate::harness::ringwing;
use std::{
    fs::{self, Permissions},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// Longest time for a cluster of one machine to come up, and for its jobs to end. Shorter fails on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);
/// Number of tasks of the job array.
const TASKS: u32 = 3;

const SWEEP: &str = r#"
name = "cluster"
scenario = "paper-4.1"
seeds = 2
[set]
formation.uavs = 3
time.duration_s = 0.3
[axes]
control.law = ["paper", "resilient"]
leader.speed_m_s = [15, 16]
"#;

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/cluster").join(name)
}

/// Those of `programs` that are not installed.
fn missing<'p>(programs: &[&'p str]) -> Vec<&'p str> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<_> = std::env::split_paths(&path).chain(["/usr/sbin".into(), "/sbin".into()]).collect();
    let is_missing = |name: &&str| !folders.iter().any(|folder| folder.join(name).is_file());
    programs.iter().copied().filter(is_missing).collect()
}

/// Joins the shards in `out` and compares them with the whole sweep, flown without a cluster.
fn assert_whole(folder: &Path, sweep: &Path, out: &Path) {
    let run = |arguments: &[&Path]| {
        let output = ringwing().arg("sweep").args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    run(&[Path::new("merge"), out]);
    let whole = folder.join("whole");
    run(&[sweep, Path::new("--out"), &whole]);
    let rows = |folder: &Path| fs::read_to_string(folder.join("flights.csv")).unwrap();
    assert_eq!(rows(out), rows(&whole));
}

/// A folder with the sweep's file, and where its results go.
fn place() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let (sweep, out) = (folder.path().join("cluster.toml"), folder.path().join("out"));
    fs::write(&sweep, SWEEP).unwrap();
    (folder, sweep, out)
}

#[test]
fn the_job_file_of_gnu_parallel_flies_every_shard() {
    let missing = missing(&["parallel"]);
    if !missing.is_empty() {
        eprintln!("skipped: {missing:?} are not installed");
        return;
    }
    let (folder, sweep, out) = place();
    let status = Command::new(example("parallel.sh"))
        .args([&sweep, &out])
        .args(["3", "--jobs", "2"])
        .env("RINGWING", env!("CARGO_BIN_EXE_ringwing"))
        .status()
        .unwrap();
    assert!(status.success());
    assert_whole(folder.path(), &sweep, &out);
}

/// A Slurm of one machine, with a munged of its own by which its programs trust each other. Its daemons end with it.
struct Slurm {
    config: PathBuf,
    daemons: Vec<Child>,
}

impl Slurm {
    /// Starts controller and node in `folder`, without accounting and without the system's configuration.
    fn start(folder: &Path) -> Self {
        let config = folder.join("slurm.conf");
        fs::create_dir(folder.join("state")).unwrap();
        fs::create_dir(folder.join("spool")).unwrap();
        fs::write(&config, configuration(folder)).unwrap();
        // slurmd loads a plugin for control groups even if nothing uses them; this one asks nothing of the machine.
        fs::write(folder.join("cgroup.conf"), "CgroupPlugin=cgroup/v1\n").unwrap();
        let mut slurm = Self { config, daemons: Vec::new() };
        slurm.start_munge(folder);
        for name in ["slurmctld", "slurmd"] {
            let mut command = Command::new(format!("/usr/sbin/{name}"));
            command.args(["-D", "-f"]).arg(&slurm.config);
            slurm.start_daemon(name, command);
        }
        slurm
    }

    fn start_munge(&mut self, folder: &Path) {
        let (key, socket) = (folder.join("munge.key"), folder.join("munge.socket"));
        fs::write(&key, [7; 128]).unwrap();
        // munged refuses a key that others may read, and a socket that others cannot reach.
        fs::set_permissions(&key, Permissions::from_mode(0o600)).unwrap();
        fs::set_permissions(folder, Permissions::from_mode(0o755)).unwrap();
        let mut command = Command::new("/usr/sbin/munged");
        command.arg("--foreground").arg("--force");
        for (option, file) in
            [("key", "munge.key"), ("socket", "munge.socket"), ("pid", "munged.pid"), ("seed", "munge.seed")]
        {
            let option = if option == "socket" { "--socket".to_owned() } else { format!("--{option}-file") };
            command.arg(format!("{option}={}", folder.join(file).display()));
        }
        command.arg(format!("--log-file={}", folder.join("munge.log").display()));
        self.start_daemon("munged", command);
        self.wait_until("munged answers", || socket.exists());
    }

    fn start_daemon(&mut self, name: &str, mut command: Command) {
        let log = fs::File::create(self.config.with_file_name(format!("{name}.log"))).unwrap();
        command.stdin(Stdio::null()).stdout(log.try_clone().unwrap()).stderr(log);
        self.daemons.push(command.spawn().unwrap());
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", &self.config);
        command
    }

    /// Waits until `holds`; fails with the daemons' logs.
    fn wait_until(&self, what: &str, holds: impl Fn() -> bool) {
        let start = Instant::now();
        while !holds() {
            let logs =
                ["munged.log", "slurmctld.log", "slurmd.log"].map(|name| self.config.with_file_name(name));
            let text =
                || logs.iter().map(|log| fs::read_to_string(log).unwrap_or_default()).collect::<String>();
            assert!(start.elapsed() < PATIENCE, "timed out waiting until {what}:\n{}", text());
            thread::sleep(Duration::from_millis(100));
        }
    }

    fn output(&self, program: &str, arguments: &[&str]) -> String {
        let output = self.command(program).args(arguments).output().unwrap();
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        // The last first: slurmd tells the controller that it leaves.
        for daemon in self.daemons.iter_mut().rev() {
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }
}

fn configuration(folder: &Path) -> String {
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap();
    let (host, folder) = (host.trim(), folder.display());
    // Other tests, and a Slurm of the machine itself, use other ports.
    let port = 20_000 + std::process::id() % 20_000;
    format!(
        "ClusterName=test\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={port}\nSlurmdPort={}\nSlurmUser=root\nSlurmdUser=root\n\
         StateSaveLocation={folder}/state\nSlurmdSpoolDir={folder}/spool\nSlurmctldPidFile={folder}/ctld.pid\n\
         SlurmdPidFile={folder}/d.pid\nAuthType=auth/munge\nAuthInfo=socket={folder}/munge.socket\nProctrackType=proctrack/pgid\nTaskPlugin=task/none\n\
         SchedulerType=sched/builtin\nSelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\n\
         JobCompType=jobcomp/none\nMpiDefault=none\nReturnToService=2\n\
         NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN\nPartitionName=main Nodes={host} Default=YES State=UP OverSubscribe=YES\n",
        port + 1
    )
}

#[test]
fn the_job_file_of_slurm_flies_every_shard_on_a_cluster_of_one_machine() {
    let missing = missing(&["slurmctld", "slurmd", "sbatch", "squeue", "munged"]);
    if !missing.is_empty() {
        eprintln!("skipped: {missing:?} are not installed");
        return;
    }
    if !rustix::process::geteuid().is_root() {
        eprintln!("skipped: slurmd needs root");
        return;
    }
    let (folder, sweep, out) = place();
    let slurm = Slurm::start(folder.path());
    slurm.wait_until("the node is idle", || slurm.output("sinfo", &["-h", "-o", "%t"]).contains("idle"));
    let status = slurm
        .command("sbatch")
        .arg(format!("--array=1-{TASKS}"))
        .args(["--cpus-per-task=1", "--chdir"])
        .arg(folder.path())
        .arg(example("slurm.sh"))
        .args([&sweep, &out])
        .env("RINGWING", env!("CARGO_BIN_EXE_ringwing"))
        .status()
        .unwrap();
    assert!(status.success());
    slurm.wait_until("all tasks have ended", || slurm.output("squeue", &["-h", "-r"]).is_empty());
    assert_whole(folder.path(), &sweep, &out);
}
