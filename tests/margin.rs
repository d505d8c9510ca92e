//! `ringwing margin`: the same answer on any number of threads, errors that say what to do, and theory beside the flights.

use crate::harness::{ringwing, send, status_of, wait_until};
use rustix::process::Signal;
use serde_json::Value;
use std::{
    fs,
    process::{Output, Stdio},
};

/// A flight of a second that violates nothing unless a search makes it.
const SHORT: &str = "name = \"short\"\ntime.duration_s = 1.0\nformation.uavs = 3\n";

/// A search over [`SHORT`]; the words of `arguments` follow.
fn margin(arguments: &[&str]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("short.toml");
    fs::write(&file, SHORT).unwrap();
    ringwing().arg("margin").arg(file).args(arguments).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_margin_does_not_depend_on_the_number_of_threads() {
    // Whether two of the drawn starts are closer than this depends on the seed.
    let of =
        ["--of", "requirements.separation_min_m={x}", "--between", "0..150", "--flights-max", "40", "--json"];
    let found = |jobs: &'static str| {
        let output = margin(&[of.as_slice(), &["--resolution", "20", "--jobs", jobs]].concat());
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        let mut result: Value = serde_json::from_slice(&output.stdout).unwrap();
        // The scenario lies in another folder each time.
        result["scenario"].take();
        result
    };
    let result = found("1");
    assert_eq!(found("3"), result);
    // Forty flights in a row that pass do not show 95 %.
    assert_eq!((&result["finding"], &result["value"]), (&"unclear".into(), &Value::Null));
}

#[test]
fn a_margin_is_found_with_its_interval_and_number_of_flights() {
    let of =
        ["--of", "requirements.separation_min_m={x}", "--between", "0..150", "--success", "0.6", "--json"];
    let output = margin(&[of.as_slice(), &["--resolution", "20", "--flights-max", "60"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    let number = |key: &str| result[key].as_f64().unwrap();
    assert!(number("low") < number("value") && number("value") < number("high"), "{result}");
    let flights: u64 =
        result["values"].as_array().unwrap().iter().map(|value| value["flights"].as_u64().unwrap()).sum();
    assert_eq!(result["flights"].as_u64(), Some(flights));
    let success = |value: f64| {
        let flown =
            result["values"].as_array().unwrap().iter().find(|flown| flown["value"] == value).unwrap();
        flown["success"].as_f64().unwrap()
    };
    assert!(success(number("low")) > 0.6 && success(number("high")) < 0.6, "{result}");
}

#[test]
fn a_search_without_a_margin_says_why() {
    for (of, between, code, message) in [
        (
            "link all->all delay 1 s",
            "0..2",
            2,
            "error: --of: \"link all->all delay 1 s\" needs exactly one {x}",
        ),
        ("link all->all delay {x} s", "2..2", 2, "error: --between: empty range"),
        ("control.gain={x}", "0..2", 2, "control.gain"),
        ("at 0.5 s link 1<->2 delay {x} s", "0..1", 1, "error: flights succeed everywhere between 0 and 1"),
        ("requirements.separation_min_m={x}", "1000..2000", 1, "error: flights fail everywhere"),
    ] {
        let output = margin(&["--of", of, "--between", between, "--flights-max", "200"]);
        assert_eq!(output.status.code(), Some(code), "{of}: {}", stderr(&output));
        assert!(stderr(&output).contains(message), "{of}: {}", stderr(&output));
    }
}

#[test]
fn theory_is_printed_beside_the_flights() {
    let arguments = ["--of", "link own->all delay {x} ms", "--between", "0..1000", "--theory", "--json"];
    let few = ["--flights-max", "1"];
    let output = margin(&[arguments.as_slice(), &few].concat());
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    let own =
        result["theory"].as_array().unwrap().iter().find(|line| line["late"] == "own state late").unwrap();
    // Half a tick of 10 ms below the 69.9 ms of the law in continuous time.
    assert!((own["number"].as_f64().unwrap() - 64.9).abs() < 1.5, "{own}");
}

#[test]
fn an_interrupted_search_says_so() {
    let mut command = ringwing();
    command.args(["margin", "paper-4.1", "--of", "link all->all loss {x} %", "--between", "0..90", "--json"]);
    command.args(["--set", "time.duration_s=20", "--set", "requirements.slot_error_max_m=500"]);
    command.args(["--flights-max", "1000000", "--confidence", "0.999999"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The handler of signals is there before the first flight.
    wait_until("the search flies", || {
        let threads: u32 = status_of(child.id(), "Threads")?.parse().ok()?;
        (threads > 2).then_some(())
    });
    send(child.id(), Signal::INT);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["finding"], "interrupted");
    assert!(stderr(&output).contains("error: interrupted after"), "{}", stderr(&output));
}
