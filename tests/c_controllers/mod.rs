//! Controllers in C and C++: the library is built and installed as a user does it, and programs that link with it fly.
//!
//! The tests in C++ skip where there is no compiler for it. One for C is always there, because Rust needs it to link.

use crate::{
    controllers::{built, consensus, output, verify},
    harness::{Finished, Swarm},
};
use ringwing_flight::{Part, UavId};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

/// Where `controller/c/install.sh` has installed the library.
fn installed() -> &'static Path {
    static INSTALLED: OnceLock<tempfile::TempDir> = OnceLock::new();
    let prefix = INSTALLED.get_or_init(|| {
        // The whole workspace, so that the library is built of what the command under test was built of.
        let bin = built(&["--workspace", "--lib"]);
        let prefix = tempfile::tempdir().unwrap();
        let mut install = Command::new("sh");
        install.arg(root().join("controller/c/install.sh")).arg(prefix.path()).arg(bin);
        succeeds(install);
        prefix
    });
    prefix.path()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs `command`, which has to succeed; returns what it prints.
fn succeeds(mut command: Command) -> String {
    let output = command.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {}\n{errors}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

/// Whether a program that a test cannot do without is there; says so if not.
fn has(program: &str) -> bool {
    let found = Command::new(program).arg("--version").output().is_ok();
    if !found {
        eprintln!("skipped: {program} is not installed");
    }
    found
}

/// Compiles `source` with `compiler` and links it with the shared library; returns the program.
fn compiled(compiler: &str, standard: &str, source: &Path) -> PathBuf {
    let prefix = installed();
    let program = prefix.join(source.file_stem().unwrap());
    let mut compile = Command::new(compiler);
    compile.args([standard, "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]).arg(source);
    compile.arg("-o").arg(&program).args(flags(prefix));
    // The linker does not look for libraries there when the program starts, so the program has to say where they are.
    compile.arg(format!("-Wl,-rpath,{}/lib", prefix.display()));
    succeeds(compile);
    program
}

/// What pkg-config says how to compile with the library, or the same where there is no pkg-config.
fn flags(prefix: &Path) -> Vec<String> {
    if Command::new("pkg-config").arg("--version").output().is_err() {
        let prefix = prefix.display();
        return vec![format!("-I{prefix}/include"), format!("-L{prefix}/lib"), "-lringwing".into()];
    }
    let mut ask = Command::new("pkg-config");
    ask.args(["--cflags", "--libs", "ringwing"]).env("PKG_CONFIG_PATH", prefix.join("lib/pkgconfig"));
    succeeds(ask).split_whitespace().map(Into::into).collect()
}

/// A program in C++, compiled once for all tests; `None` if there is no compiler.
fn in_cpp(program: &'static OnceLock<Option<PathBuf>>, source: &str) -> Option<&'static str> {
    let path = program
        .get_or_init(|| has("c++").then(|| compiled("c++", "-std=c++17", &root().join(source))))
        .as_ref()?;
    path.to_str()
}

fn consensus_in_cpp() -> Option<&'static str> {
    static COMPILED: OnceLock<Option<PathBuf>> = OnceLock::new();
    in_cpp(&COMPILED, "examples/controllers/cpp/consensus.cpp")
}

/// The controller that breaks in the way that its first argument names.
pub fn broken_in_cpp() -> Option<&'static str> {
    static COMPILED: OnceLock<Option<PathBuf>> = OnceLock::new();
    in_cpp(&COMPILED, "tests/c_controllers/broken.cpp")
}

fn ring_of(program: &str) -> Finished {
    let run = Swarm::fly("paper-4.1").agent(&format!("all={program} --gain 0.6")).finish();
    run.assert_ended_with(0);
    run
}

#[test]
fn a_controller_in_cpp_flies_as_the_same_law_in_rust_and_its_flight_repeats_to_the_bit() {
    let Some(program) = consensus_in_cpp() else { return };
    let run = ring_of(program);
    assert!(run.number("slot_error_max_m") < 0.01, "{:#}", run.summary);
    assert!(verify(&run).status.success());
    let logs = [&run, &ring_of(consensus())].map(Finished::log);
    for uav in 1..=6 {
        let [in_cpp, in_rust] = logs.each_ref().map(|log| log.states(uav).pop().unwrap());
        let apart_m = (in_cpp.x_m - in_rust.x_m).hypot(in_cpp.y_m - in_rust.y_m);
        // A compiler may round differently, and the law brings the difference down again.
        assert!(apart_m < 1e-6, "uav {uav}: {in_cpp:?} {in_rust:?}");
        let [in_cpp, in_rust] = logs.each_ref().map(|log| log.notes(uav));
        assert_eq!(in_cpp.len(), in_rust.len());
        let [first_in_cpp, first_in_rust] = [&in_cpp[1].notes[0], &in_rust[1].notes[0]];
        assert_eq!(first_in_cpp.name, first_in_rust.name);
        assert!(
            (first_in_cpp.value - first_in_rust.value).abs() < 1e-6,
            "{first_in_cpp:?} {first_in_rust:?}"
        );
    }
}

#[test]
fn controllers_in_cpp_survive_the_loss_of_a_uav_and_being_killed_and_started_again() {
    let Some(program) = consensus_in_cpp() else { return };
    let run = Swarm::fly("dropout")
        .with("--law resilient")
        .fault("at 50 s restart uav 2 after 5 s")
        .agent(&format!("1, 2={program}"))
        .start();
    run.wait_for_second(5.0);
    let executable = fs::read_link(format!("/proc/{}/exe", run.process(Part::Agent(UavId(2))))).unwrap();
    assert_eq!(executable, Path::new(program).canonicalize().unwrap());
    let run = run.finish();
    run.assert_ended_with(0);
    for event in ["uav 3 is killed", "uav 2 is killed", "uav 2 is started"] {
        assert!(run.stderr.contains(event), "{}", run.stderr);
    }
}

#[test]
fn each_broken_controller_in_cpp_is_named_and_the_others_fly_on() {
    let Some(program) = broken_in_cpp() else { return };
    let ways = ["throws", "throws-through", "sleeps", "exits", "nan", "notes-wrongly"];
    let mut run = Swarm::fly("paper-4.1")
        .with("--duration 10 --set failsafe=hold --set supervision.answer_timeout_s=1");
    for (uav, way) in (1..).zip(ways) {
        run = run.agent(&format!("{uav}={program} {way}"));
    }
    let run = run.finish();
    run.assert_ended_with(3);
    let lines = run.log().lines();
    for event in [
        "process.lost: uav 1",
        "process.lost: uav 2",
        "process.silent: uav 3",
        "process.lost: uav 4",
        "controller.not_finite: uav 5",
        "controller.note: the note \"not a name\" of uav 6",
        "controller.note: the note \"n16\" of uav 6",
    ] {
        assert!(lines.iter().any(|line| line.starts_with(event)), "no {event:?} in {lines:#?}");
    }
    assert!(output(&run, 1).contains("out of ideas"), "{}", output(&run, 1));
    assert!(output(&run, 2).contains("foreign exception"), "{}", output(&run, 2));
    assert_eq!(run.log().states(6).last().unwrap().mode, "commanded");
    assert!(run.stderr.contains("warning: the note \"n16\" of uav 6 is not recorded"), "{}", run.stderr);
    assert!(run.log().notes(6).iter().all(|notes| notes.notes.len() == 16), "the others are recorded");
}

/// The example of the manual's page, so that what it shows compiles and flies.
#[test]
fn the_controller_in_c_of_the_manual_flies_with_the_static_library() {
    let page = fs::read_to_string(root().join("docs/src/controllers.md")).unwrap();
    let (_, rest) = page.split_once("```c\n").unwrap();
    let (example, _) = rest.split_once("```\n").unwrap();
    let prefix = installed();
    let (source, program) = (prefix.join("straight.c"), prefix.join("straight"));
    fs::write(&source, example).unwrap();
    let mut compile = Command::new("cc");
    compile.args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-o"]).arg(&program).arg(&source);
    compile.arg(format!("-I{}/include", prefix.display())).arg(prefix.join("lib/libringwing.a"));
    // Those of `Libs.private` in ringwing.pc.
    compile.args(["-lgcc_s", "-lutil", "-lrt", "-lpthread", "-lm", "-ldl"]);
    succeeds(compile);
    let agent = format!("3={}", program.display());
    let run = Swarm::fly("paper-4.1").with("--duration 5").agent(&agent).finish();
    // It leaves the formation, which violates a requirement.
    run.assert_ended_with(3);
    let (first, last) = (&run.log().states(3)[0], run.log().states(3).pop().unwrap());
    assert_eq!(last.heading_rad, first.heading_rad, "it flies straight on");
}

#[test]
fn cmake_finds_the_installed_library() {
    if !(has("cmake") && has("c++")) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(root().join("examples/controllers/cpp")).arg("-B").arg(folder.path());
    configure.arg(format!("-DCMAKE_PREFIX_PATH={}", installed().display()));
    succeeds(configure);
    let mut build = Command::new("cmake");
    build.arg("--build").arg(folder.path());
    succeeds(build);
    let agent = format!("3={}", folder.path().join("consensus").display());
    Swarm::fly("paper-4.1").agent(&agent).finish().assert_ended_with(0);
}
