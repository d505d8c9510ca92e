//! What machine this is, and what of it spoils a measurement.
//!
//! Never changes anything, and never guesses: what cannot be read is "not readable here".

mod parse;

use super::result::Machine;
use std::{fs, thread, time::Duration};

/// Reads a file that the kernel shows; none where it is not there or not for us.
type Look<'a> = &'a dyn Fn(&str) -> Option<String>;

/// Facts that are others at every look, on the same machine as well.
pub(crate) const MOMENTARY: [&str; 3] = ["memory available", "load average", "busy"];

/// How long the processors are watched to see whether they are busy.
const WATCH: Duration = Duration::from_millis(250);
/// Of the processors' time: what others may take before it shows in a measurement.
const BUSY: f64 = 0.05;
/// Of the processors' time: what the host may take.
const STOLEN: f64 = 0.01;
/// Clock sources that are read without a system call.
const FAST_CLOCKS: [&str; 5] =
    ["tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter", "riscv_clocksource"];
/// Letters of a line.
const WIDTH: usize = 106;
const UNREADABLE: &str = "not readable here";

/// What a fact is called, and how it is found.
type Fact = (&'static str, fn(Look) -> Option<String>);

const FACTS: [Fact; 21] = [
    ("processor", |look| parse::processor(&look("/proc/cpuinfo")?)),
    ("cores usable", |look| Some(parse::usable_cores(&look("/proc/self/status")?)?.to_string())),
    ("cores online", |look| line(look, "/sys/devices/system/cpu/online")),
    ("SMT", |look| Some(switch(smt(look)?))),
    ("governor", |look| line(look, "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")),
    ("turbo", |look| Some(switch(turbo(look)?))),
    ("virtual machine", |look| parse::virtual_machine(look)),
    ("container", |look| Some(parse::container(look))),
    ("CPU quota", |look| {
        look("/proc/self/cgroup")?;
        Some(quota(look).map_or("none".into(), |cores| format!("{cores:.2} cores")))
    }),
    ("kernel", |look| {
        Some(format!(
            "{} {}",
            line(look, "/proc/sys/kernel/osrelease")?,
            line(look, "/proc/sys/kernel/version")?
        ))
    }),
    ("clock source", clock_source),
    ("mitigations", |look| parse::mitigations(look)),
    ("huge pages", |look| parse::chosen(&look("/sys/kernel/mm/transparent_hugepage/enabled")?)),
    ("memory", |look| parse::memory(&look("/proc/meminfo")?, "MemTotal")),
    ("memory available", |look| parse::memory(&look("/proc/meminfo")?, "MemAvailable")),
    ("page size", |_| Some(format!("{} B", rustix::param::page_size()))),
    ("load average", |look| parse::load_average(&look("/proc/loadavg")?)),
    ("open files", |look| parse::limit(&look("/proc/self/limits")?, "Max open files")),
    ("locked memory", |look| parse::limit(&look("/proc/self/limits")?, "Max locked memory")),
    ("real-time priority", |look| parse::limit(&look("/proc/self/limits")?, "Max realtime priority")),
    ("build", |_| Some(if cfg!(debug_assertions) { "debug" } else { "release" }.into())),
];

/// Looks at this machine; takes a quarter of a second.
pub(crate) fn inspect() -> Machine {
    let look = |path: &str| fs::read_to_string(path).ok();
    let before = look("/proc/stat");
    thread::sleep(WATCH);
    let after = look("/proc/stat");
    let activity = before.zip(after).and_then(|(before, after)| parse::activity(&before, &after));
    examine(&look, activity, cfg!(debug_assertions))
}

/// The facts by lines, then what spoils a measurement.
pub(crate) fn render(machine: &Machine) -> String {
    let mut text = String::from("Machine\n");
    let width = machine.facts.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    text.extend(machine.facts.iter().map(|(name, value)| format!("  {name:<width$}  {value}\n")));
    if machine.warnings.is_empty() {
        return text + "\nNothing was seen that spoils a measurement.\n";
    }
    text.push_str("\nWhat spoils a measurement here\n");
    text.extend(machine.warnings.iter().map(|warning| item(warning)));
    text
}

/// One of a list, its lines no longer than [`WIDTH`].
fn item(warning: &str) -> String {
    let mut text = String::from("  -");
    let mut column = text.len();
    for word in warning.split(' ') {
        let length = 1 + word.chars().count();
        if column + length > WIDTH {
            text.push_str("\n   ");
            column = 3;
        }
        text.extend([" ", word]);
        column += length;
    }
    text + "\n"
}

/// What to say where more processes than cores take part in a tick; none if each has its own.
pub(crate) fn crowded(processes: u32) -> Option<String> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    crowded_on(parse::usable_cores(&status)?, processes)
}

fn crowded_on(cores: usize, processes: u32) -> Option<String> {
    (processes as usize > cores).then(|| {
        format!(
            "up to {processes} processes share {cores} cores: ticks wait for the scheduler; measure fewer UAVs or on \
             more cores to see the transport alone"
        )
    })
}

fn examine(look: Look, activity: Option<parse::Activity>, is_debug_build: bool) -> Machine {
    let found = |(name, find): &Fact| (String::from(*name), find(look).unwrap_or_else(|| UNREADABLE.into()));
    let mut facts: Vec<_> = FACTS.iter().map(found).collect();
    facts.push(("busy".into(), activity.map_or(UNREADABLE.into(), |activity| activity.to_string())));
    let warnings = [
        is_debug_build.then(|| "this is a debug build: build with `cargo build --release`".into()),
        activity.and_then(busy_warning),
        activity.and_then(steal_warning),
        quota_warning(look),
        governor_warning(look),
        turbo_warning(look),
        smt_warning(look),
        clock_warning(look),
    ];
    Machine { facts, warnings: warnings.into_iter().flatten().collect() }
}

/// The first line of a file, if it says anything.
fn line(look: Look, path: &str) -> Option<String> {
    let text = look(path)?;
    let line = text.lines().next()?.trim();
    (!line.is_empty()).then(|| line.to_owned())
}

fn switch(is_on: bool) -> String {
    if is_on { "on" } else { "off" }.into()
}

fn smt(look: Look) -> Option<bool> {
    Some(line(look, "/sys/devices/system/cpu/smt/active")? == "1")
}

fn turbo(look: Look) -> Option<bool> {
    let intel = || Some(line(look, "/sys/devices/system/cpu/intel_pstate/no_turbo")? == "0");
    let other = || Some(line(look, "/sys/devices/system/cpu/cpufreq/boost")? == "1");
    intel().or_else(other)
}

fn clock_source(look: Look) -> Option<String> {
    line(look, "/sys/devices/system/clocksource/clocksource0/current_clocksource")
}

/// The cores' worth of time that control groups allow; none where none sets a limit.
fn quota(look: Look) -> Option<f64> {
    let files = parse::quota_files(&look("/proc/self/cgroup")?);
    let limits = files.iter().filter_map(|path| parse::quota_cores(&look(path)?));
    limits.min_by(f64::total_cmp)
}

fn busy_warning(activity: parse::Activity) -> Option<String> {
    (activity.busy > BUSY).then(|| {
        format!(
            "the processors are {:.0} % busy with something else: end what else runs, or measure when it has ended",
            100.0 * activity.busy
        )
    })
}

fn steal_warning(activity: parse::Activity) -> Option<String> {
    let most = activity.stolen.max(activity.stolen_since_boot);
    (most > STOLEN).then(|| {
        format!(
            "the host of this virtual machine takes {:.1} % of its time away (steal in /proc/stat): measure on a \
             machine of your own, or ask for dedicated cores",
            100.0 * most
        )
    })
}

fn quota_warning(look: Look) -> Option<String> {
    let cores = quota(look)?;
    Some(format!(
        "a control group allows {cores:.2} cores' worth of time and stops everybody when it is used up: lift cpu.max, \
         or start the container without a CPU limit"
    ))
}

fn governor_warning(look: Look) -> Option<String> {
    let governor = line(look, "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")?;
    (governor != "performance").then(|| {
        format!(
            "the governor `{governor}` clocks the processors down between ticks: \
             `cpupower frequency-set --governor performance`"
        )
    })
}

fn turbo_warning(look: Look) -> Option<String> {
    let how = if look("/sys/devices/system/cpu/intel_pstate/no_turbo").is_some() {
        "echo 1 > /sys/devices/system/cpu/intel_pstate/no_turbo"
    } else {
        "echo 0 > /sys/devices/system/cpu/cpufreq/boost"
    };
    turbo(look)?
        .then(|| format!("turbo is on, and the clock varies with heat and with what others do: `{how}`"))
}

fn smt_warning(look: Look) -> Option<String> {
    smt(look)?.then(|| {
        "SMT is on, and two processes may share one core: `echo off > /sys/devices/system/cpu/smt/control`".into()
    })
}

fn clock_warning(look: Look) -> Option<String> {
    let source = clock_source(look)?;
    (!FAST_CLOCKS.contains(&source.as_str())).then(|| {
        format!(
            "reading the clock source `{source}` takes a system call, which counts into every hop: boot with \
             `clocksource=tsc`, if the processor's is stable"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    const CALM: parse::Activity = parse::Activity { busy: 0.01, stolen: 0.0, stolen_since_boot: 0.001 };

    /// A machine on which nothing is wrong, changed by `changes`: a path and what it says.
    fn on(changes: &[(&str, &str)], activity: parse::Activity) -> Machine {
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
        let look = |path: &str| files.get(path).map(|text| (*text).to_owned());
        examine(&look, Some(activity), false)
    }

    fn fact<'m>(machine: &'m Machine, name: &str) -> &'m str {
        &machine.facts.iter().find(|(known, _)| known == name).unwrap().1
    }

    #[test]
    fn a_quiet_machine_is_not_blamed() {
        let machine = on(&[], CALM);
        assert_eq!(machine.warnings, Vec::<String>::new());
        assert_eq!((fact(&machine, "cores usable"), fact(&machine, "turbo")), ("4", "off"));
        assert_eq!((fact(&machine, "CPU quota"), fact(&machine, "processor")), ("none", UNREADABLE));
        assert!(render(&machine).ends_with("Nothing was seen that spoils a measurement.\n"));
    }

    #[test]
    fn whatever_spoils_a_measurement_is_told_with_its_cure() {
        let governor = "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor";
        let clock = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
        let cases = [
            (governor, "powersave", "cpupower frequency-set --governor performance"),
            ("/sys/devices/system/cpu/intel_pstate/no_turbo", "0", "echo 1 > /sys/devices"),
            ("/sys/devices/system/cpu/smt/active", "1", "echo off >"),
            (clock, "hpet", "clocksource=tsc"),
            ("/sys/fs/cgroup/user.slice/cpu.max", "150000 100000", "1.50 cores' worth"),
            ("/sys/fs/cgroup/cpu.max", "50000 100000", "0.50 cores' worth"),
        ];
        for (path, text, said) in cases {
            let warnings = on(&[(path, text)], CALM).warnings;
            assert!(warnings.len() == 1 && warnings[0].contains(said), "{path}: {warnings:?}");
        }
    }

    #[test]
    fn a_busy_machine_and_a_greedy_host_are_told() {
        let busy = on(&[], parse::Activity { busy: 0.6, ..CALM }).warnings;
        assert!(busy.len() == 1 && busy[0].contains("60 % busy"), "{busy:?}");
        let robbed = on(&[], parse::Activity { stolen_since_boot: 0.042, ..CALM }).warnings;
        assert!(robbed.len() == 1 && robbed[0].contains("4.2 %"), "{robbed:?}");
    }

    #[test]
    fn a_debug_build_is_the_first_thing_to_cure() {
        let machine = examine(&|_| None, None, true);
        assert_eq!(machine.warnings.len(), 1);
        assert!(machine.warnings[0].contains("cargo build --release"));
    }

    #[test]
    fn where_nothing_is_readable_that_is_said() {
        let machine = examine(&|_| None, None, false);
        let unreadable = machine.facts.iter().filter(|(_, value)| value == UNREADABLE).count();
        // All but the page size, the build, and the container, of which there is no trace.
        assert_eq!(unreadable, machine.facts.len() - 3, "{:?}", machine.facts);
    }

    #[test]
    fn more_processes_than_cores_are_a_crowd() {
        assert_eq!(crowded_on(4, 4), None);
        assert!(crowded_on(2, 8).unwrap().contains("8 processes share 2 cores"));
    }

    #[test]
    fn long_warnings_are_broken_between_words() {
        let facts = vec![("cores".to_owned(), "2".to_owned())];
        let text = render(&Machine { facts, warnings: vec!["twelve words ".repeat(20).trim().into()] });
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert_eq!(
            text.matches("twelve words").count() + text.matches("twelve\n    words").count(),
            20,
            "{text}"
        );
    }

    #[test]
    fn this_machine_can_be_looked_at() {
        let machine = inspect();
        assert!(fact(&machine, "cores usable").parse::<usize>().unwrap() >= 1);
        assert!(fact(&machine, "page size").ends_with(" B"));
        let text = render(&machine);
        assert!(machine.facts.iter().all(|(_, value)| text.contains(value.as_str())));
    }
}
