//! Looks at the machine: its properties, and what about it spoils a measurement.
//!
//! Must never change anything, and must never guess: what cannot be read is shown as "not readable here".

use crate::{
    kernel_files::{self, Activity, ReadFile, first_line},
    machine::UNREADABLE,
    result::Machine,
};
use ringwing_bus::{Capacity, Demand, MemorySpace};
use ringwing_scenario::Scenario;
use std::{fs, thread, time::Duration};

/// Facts that change from moment to moment, even on the same machine.
pub(crate) const MOMENTARY: [&str; 4] = ["memory available", "shared memory", "load average", "busy"];

/// Time for which the cores are watched to find out whether they are busy. Timer ticks are 4 to 10 ms apart, so a shorter
/// time counts too few of them.
const WATCH: Duration = Duration::from_millis(250);
/// Share of the CPU time that other programs may take without a warning. A lower limit warns on any desktop; a higher
/// one misses programs that slow ticks down.
const MAX_BUSY: f64 = 0.05;
/// Share of the CPU time that the host of a virtual machine may take without a warning. A lower limit warns on most
/// virtual machines; a higher one misses a crowded host.
const MAX_STOLEN: f64 = 0.01;
/// Number of UAVs for which the machine should have room: the largest swarm of a whole benchmark. With more, the doctor warns of
/// machines that suffice; with fewer, the benchmark's last cases fail.
const UAVS: u32 = 200;
const GB: f64 = 1e9;
/// Clock sources that can be read without a system call.
const FAST_CLOCKS: [&str; 5] =
    ["tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter", "riscv_clocksource"];

/// Name of a fact, and how to find it.
type Fact = (&'static str, fn(ReadFile) -> Option<String>);

const FACTS: [Fact; 22] = [
    ("processor", |read| kernel_files::processor(&read("/proc/cpuinfo")?)),
    ("cores usable", |read| Some(kernel_files::usable_cores(&read("/proc/self/status")?)?.to_string())),
    ("cores online", |read| first_line(read, "/sys/devices/system/cpu/online")),
    ("SMT", |read| Some(on_or_off(smt(read)?))),
    ("governor", governor),
    ("turbo", |read| Some(on_or_off(turbo(read)?))),
    ("virtual machine", |read| kernel_files::virtual_machine(read)),
    ("container", |read| Some(kernel_files::container(read))),
    ("CPU quota", |read| {
        // Without this file the quota is unknown. If the file exists and sets no limit, there is no quota.
        read("/proc/self/cgroup")?;
        Some(quota_cores(read).map_or("none".into(), |cores| format!("{cores:.2} cores")))
    }),
    ("kernel", |read| {
        Some(format!(
            "{} {}",
            first_line(read, "/proc/sys/kernel/osrelease")?,
            first_line(read, "/proc/sys/kernel/version")?
        ))
    }),
    ("clock source", clock_source),
    ("mitigations", |read| kernel_files::mitigations(read)),
    ("huge pages", |read| kernel_files::bracketed(&read("/sys/kernel/mm/transparent_hugepage/enabled")?)),
    ("memory", |read| kernel_files::memory(&read("/proc/meminfo")?, "MemTotal")),
    ("memory available", |read| kernel_files::memory(&read("/proc/meminfo")?, "MemAvailable")),
    ("page size", |_| Some(format!("{} B", rustix::param::page_size()))),
    ("load average", |read| kernel_files::load_average(&read("/proc/loadavg")?)),
    ("open files", |read| kernel_files::limit(&read("/proc/self/limits")?, "Max open files")),
    ("processes", |read| kernel_files::limit(&read("/proc/self/limits")?, "Max processes")),
    ("locked memory", |read| kernel_files::limit(&read("/proc/self/limits")?, "Max locked memory")),
    ("real-time priority", |read| kernel_files::limit(&read("/proc/self/limits")?, "Max realtime priority")),
    ("build", |_| Some(if cfg!(debug_assertions) { "debug" } else { "release" }.into())),
];

/// Looks at this machine; takes a quarter of a second.
pub(crate) fn inspect() -> Machine {
    let read = |path: &str| fs::read_to_string(path).ok();
    // The kernel counts since boot, so what happens now is the difference of two readings.
    let before = read("/proc/stat");
    thread::sleep(WATCH);
    let after = read("/proc/stat");
    let activity = before.zip(after).and_then(|(before, after)| kernel_files::activity(&before, &after));
    examine(&read, activity, &Capacity::look(), cfg!(debug_assertions))
}

/// The warning for `processes` that take part in a tick and share cores; `None` if each has a core of its own.
pub(crate) fn crowded(processes: u32) -> Option<String> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    crowded_on(kernel_files::usable_cores(&status)?, processes)
}

fn crowded_on(cores: usize, processes: u32) -> Option<String> {
    (processes as usize > cores).then(|| {
        format!(
            "up to {processes} processes share {cores} cores, so ticks wait for the scheduler: to see the transport \
             alone, measure fewer UAVs or use more cores"
        )
    })
}

fn examine(read: ReadFile, activity: Option<Activity>, capacity: &Capacity, is_debug_build: bool) -> Machine {
    let found = |(name, find): &Fact| (String::from(*name), find(read).unwrap_or_else(|| UNREADABLE.into()));
    let mut facts: Vec<_> = FACTS.iter().map(found).collect();
    facts.push(("shared memory".into(), capacity.memory.map_or(UNREADABLE.into(), shared_memory)));
    // This one takes time to find out, so the caller has done that.
    facts.push(("busy".into(), activity.map_or(UNREADABLE.into(), |activity| activity.to_string())));
    let warnings = [
        is_debug_build.then(|| "this is a debug build: build with `cargo build --release`".into()),
        activity.and_then(busy_warning),
        activity.and_then(steal_warning),
        quota_warning(read),
        governor_warning(read),
        turbo_warning(read),
        smt_warning(read),
        clock_warning(read),
        capacity_warning(capacity),
    ];
    Machine { facts, warnings: warnings.into_iter().flatten().collect() }
}

fn shared_memory(MemorySpace { free, total }: MemorySpace) -> String {
    format!("{:.1} GB free of {:.1} GB", free as f64 / GB, total as f64 / GB)
}

/// What the machine lacks for the largest swarm of a benchmark.
fn capacity_warning(capacity: &Capacity) -> Option<String> {
    let mut scenario = Scenario::default();
    scenario.formation.uavs = UAVS;
    capacity.admit(&Demand::of(&scenario, true)).err().map(|shortage| shortage.to_string())
}

fn on_or_off(is_on: bool) -> String {
    if is_on { "on" } else { "off" }.into()
}

fn smt(read: ReadFile) -> Option<bool> {
    Some(first_line(read, "/sys/devices/system/cpu/smt/active")? == "1")
}

fn governor(read: ReadFile) -> Option<String> {
    first_line(read, "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
}

/// Intel's driver has a switch of its own, with the opposite meaning.
fn turbo(read: ReadFile) -> Option<bool> {
    let intel = || Some(first_line(read, "/sys/devices/system/cpu/intel_pstate/no_turbo")? == "0");
    let other = || Some(first_line(read, "/sys/devices/system/cpu/cpufreq/boost")? == "1");
    intel().or_else(other)
}

fn clock_source(read: ReadFile) -> Option<String> {
    first_line(read, "/sys/devices/system/clocksource/clocksource0/current_clocksource")
}

/// The strictest limit of all control groups above this process, in cores; `None` without a limit.
fn quota_cores(read: ReadFile) -> Option<f64> {
    let files = kernel_files::quota_files(&read("/proc/self/cgroup")?);
    let limits = files.iter().filter_map(|path| kernel_files::quota_cores(&read(path)?));
    limits.min_by(f64::total_cmp)
}

fn busy_warning(activity: Activity) -> Option<String> {
    (activity.busy > MAX_BUSY).then(|| {
        format!(
            "the cores are {:.0} % busy with other work: stop it, or measure when it is done",
            100.0 * activity.busy
        )
    })
}

fn steal_warning(activity: Activity) -> Option<String> {
    // A quarter of a second may show nothing of a host that takes time now and then; the share since boot does.
    let most = activity.stolen.max(activity.stolen_since_boot);
    (most > MAX_STOLEN).then(|| {
        format!(
            "the host of this virtual machine takes {:.1} % of its CPU time (steal in /proc/stat): measure on a machine \
             of your own, or ask for dedicated cores",
            100.0 * most
        )
    })
}

fn quota_warning(read: ReadFile) -> Option<String> {
    let cores = quota_cores(read)?;
    Some(format!(
        "a control group limits the CPU time to {cores:.2} cores and stops all processes when it is used up: raise \
         cpu.max, or start the container without a CPU limit"
    ))
}

fn governor_warning(read: ReadFile) -> Option<String> {
    let governor = governor(read)?;
    (governor != "performance").then(|| {
        format!(
            "the governor `{governor}` lowers the clock between ticks: \
             `cpupower frequency-set --governor performance`"
        )
    })
}

fn turbo_warning(read: ReadFile) -> Option<String> {
    let intel = "echo 1 > /sys/devices/system/cpu/intel_pstate/no_turbo";
    let other = "echo 0 > /sys/devices/system/cpu/cpufreq/boost";
    // The two switches have opposite meanings, so the remedy must name the one that exists.
    let is_intel = first_line(read, "/sys/devices/system/cpu/intel_pstate/no_turbo").is_some();
    let command = if is_intel { intel } else { other };
    turbo(read)?
        .then(|| format!("turbo is on, so the clock depends on temperature and on other load: `{command}`"))
}

fn smt_warning(read: ReadFile) -> Option<String> {
    smt(read)?.then(|| {
        "SMT is on, so two processes may share one core: `echo off > /sys/devices/system/cpu/smt/control`"
            .into()
    })
}

fn clock_warning(read: ReadFile) -> Option<String> {
    let source = clock_source(read)?;
    (!FAST_CLOCKS.contains(&source.as_str())).then(|| {
        format!(
            "reading the clock source `{source}` takes a system call, which is part of every hop: boot with \
             `clocksource=tsc` if the TSC of this processor is stable"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    const CALM: Activity = Activity { busy: 0.01, stolen: 0.0, stolen_since_boot: 0.001 };

    /// A machine on which nothing is wrong, except for `changes`: paths and the content of their files.
    fn on(changes: &[(&str, &str)], activity: Activity) -> Machine {
        let mut files = BTreeMap::from([
            ("/proc/self/status", "Name:\tx\nCpus_allowed_list:\t0-3\n"),
            ("/proc/self/cgroup", "0::/user.slice\n"),
            ("/sys/fs/cgroup/user.slice/cpu.max", "max 100000\n"),
            ("/sys/devices/system/cpu/smt/active", "0\n"),
            ("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n"),
            ("/sys/devices/system/cpu/intel_pstate/no_turbo", "1\n"),
            ("/sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"),
        ]);
        files.extend(changes.iter().copied());
        let read = |path: &str| files.get(path).map(|text| (*text).to_owned());
        examine(&read, Some(activity), &Capacity::default(), false)
    }

    fn fact<'m>(machine: &'m Machine, name: &str) -> &'m str {
        &machine.facts.iter().find(|(known, _)| known == name).unwrap().1
    }

    #[test]
    fn a_quiet_machine_gets_no_warning() {
        let machine = on(&[], CALM);
        assert_eq!(machine.warnings, Vec::<String>::new());
        assert_eq!((fact(&machine, "cores usable"), fact(&machine, "turbo")), ("4", "off"));
        assert_eq!((fact(&machine, "CPU quota"), fact(&machine, "processor")), ("none", UNREADABLE));
    }

    #[test]
    fn whatever_spoils_a_measurement_is_reported_with_a_remedy() {
        let governor = "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor";
        let clock = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
        let cases = [
            (governor, "powersave", "cpupower frequency-set --governor performance"),
            ("/sys/devices/system/cpu/intel_pstate/no_turbo", "0", "echo 1 > /sys/devices"),
            ("/sys/devices/system/cpu/smt/active", "1", "echo off >"),
            (clock, "hpet", "clocksource=tsc"),
            ("/sys/fs/cgroup/user.slice/cpu.max", "150000 100000", "1.50 cores"),
            ("/sys/fs/cgroup/cpu.max", "50000 100000", "0.50 cores"),
        ];
        for (path, text, said) in cases {
            let warnings = on(&[(path, text)], CALM).warnings;
            assert!(warnings.len() == 1 && warnings[0].contains(said), "{path}: {warnings:?}");
        }
    }

    #[test]
    fn a_busy_machine_and_a_host_that_takes_cpu_time_are_reported() {
        let busy = on(&[], Activity { busy: 0.6, ..CALM }).warnings;
        assert!(busy.len() == 1 && busy[0].contains("60 % busy"), "{busy:?}");
        let stolen = on(&[], Activity { stolen_since_boot: 0.042, ..CALM }).warnings;
        assert!(stolen.len() == 1 && stolen[0].contains("4.2 %"), "{stolen:?}");
    }

    #[test]
    fn a_machine_without_room_for_a_large_swarm_gets_a_warning() {
        let memory = Some(MemorySpace { free: 8 << 20, total: 64 << 20 });
        let machine = examine(&|_| None, None, &Capacity { memory, ..Capacity::default() }, false);
        assert!(machine.warnings.len() == 1 && machine.warnings[0].contains("--shm-size"), "{machine:?}");
        assert_eq!(fact(&machine, "shared memory"), "0.0 GB free of 0.1 GB");
        let memory = Some(MemorySpace { free: 64 << 20, total: 64 << 20 });
        let machine = examine(&|_| None, None, &Capacity { memory, ..Capacity::default() }, false);
        assert_eq!(machine.warnings, Vec::<String>::new(), "what Docker gives by default is enough");
    }

    #[test]
    fn a_debug_build_gets_a_warning() {
        let machine = examine(&|_| None, None, &Capacity::default(), true);
        assert_eq!(machine.warnings.len(), 1);
        assert!(machine.warnings[0].contains("cargo build --release"));
    }

    #[test]
    fn unreadable_facts_are_shown_as_such() {
        let machine = examine(&|_| None, None, &Capacity::default(), false);
        let unreadable = machine.facts.iter().filter(|(_, value)| value == UNREADABLE).count();
        // Only the page size, the build and the container need no file: "no sign of one".
        assert_eq!(unreadable, machine.facts.len() - 3, "{:?}", machine.facts);
    }

    #[test]
    fn more_processes_than_cores_get_a_warning() {
        assert_eq!(crowded_on(4, 4), None);
        assert!(crowded_on(2, 8).unwrap().contains("8 processes share 2 cores"));
    }

    #[test]
    fn this_machine_can_be_inspected() {
        let machine = inspect();
        assert!(fact(&machine, "cores usable").parse::<usize>().unwrap() >= 1);
        assert!(fact(&machine, "page size").ends_with(" B"));
    }
}
