"""Flights: what they return, that they repeat, and how mistakes and Ctrl-C end them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import ringwing

SHORT = {"time.duration_s": 3}


def test_a_run_has_its_folder_its_summary_and_its_verdict(dropout: ringwing.Run) -> None:
    assert dropout.folder is not None
    assert {"scenario.toml", "summary.json", "layout.json"} <= set(os.listdir(dropout.folder))
    assert json.loads((dropout.folder / "summary.json").read_text()) == dropout.summary
    assert (dropout.folder.parent / "latest").exists()
    assert dropout.summary["command"].startswith("ringwing run paper-4.2 --set time.duration_s=8")


def test_the_same_flight_has_the_same_hash_with_and_without_a_log(tmp_path: Path) -> None:
    first = ringwing.run("paper-4.1", set=SHORT, out=tmp_path)
    again = ringwing.run("paper-4.1", set=SHORT, record=False)
    other = ringwing.run("paper-4.1", set={**SHORT, "leader.speed_m_s": 16}, record=False)
    assert first.payload_hash == again.payload_hash != other.payload_hash
    assert again.folder is None
    with pytest.raises(ValueError, match="record=True"):
        again.log


def test_a_violated_requirement_is_named(tmp_path: Path) -> None:
    run = ringwing.run("paper-4.1", set={**SHORT, "requirements.settling_max_s": 0.5}, record=False)
    assert (run.verdict, run.passed) == ("violated", False)
    assert "settle" in run.summary["violations"][0]


def test_values_of_python_become_values_of_the_scenario(tmp_path: Path) -> None:
    keys = {**SHORT, "control.law": "resilient", "control.ring_closes": False, "obstacles.0.position_m": [450.5, np.float64(-20)]}
    scenario = ringwing.run("paper-4.2", set=keys, out=tmp_path).log.scenario
    assert (scenario["control"]["law"], scenario["control"]["ring_closes"]) == ("resilient", False)
    assert scenario["obstacles"][0]["position_m"] == [450.5, -20.0]
    with pytest.raises(TypeError, match="give a number, a bool"):
        ringwing.run("paper-4.1", set={"seed": object()})


def test_every_mistake_of_a_scenario_is_reported_with_its_place(in_folder: Path) -> None:
    Path("mine.toml").write_text('[formation]\nuavs = "six"\n[leader]\nsped_m_s = 3\n')
    with pytest.raises(ringwing.ScenarioError) as raised:
        ringwing.run("mine.toml")
    lines = str(raised.value).splitlines()
    assert lines[0].startswith("mine.toml:2: formation.uavs") and lines[1].startswith("mine.toml:4: leader.sped_m_s")
    with pytest.raises(ringwing.ScenarioError, match=r'set\["control.lwa"\] = paper: .*no such key'):
        ringwing.run("paper-4.1", set={"control.lwa": "paper"})
    with pytest.raises(ringwing.ScenarioError, match='fault "at 3 s kil uav 3"'):
        ringwing.run("paper-4.1", faults=["at 3 s kil uav 3"])
    with pytest.raises(ringwing.ScenarioError, match="did you mean paper-4.2"):
        ringwing.run("paper-4.3")
    with pytest.raises(TypeError, match="faults is a list of sentences"):
        ringwing.run("paper-4.1", faults="at 3 s kill uav 3")
    assert not Path("runs").exists()


def test_a_fault_that_can_have_no_effect_warns() -> None:
    with pytest.warns(ringwing.ScenarioWarning, match="at 50 s kill uav 3"):
        ringwing.run("paper-4.1", set=SHORT, faults=["at 50 s kill uav 3"], record=False)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("a file")
    with pytest.raises(ringwing.FlightError, match="runs.*cannot be written.*choose another folder with out="):
        ringwing.run("paper-4.1", set=SHORT, out=tmp_path / "runs")


def test_other_threads_run_while_a_flight_flies() -> None:
    steps = 0
    flown = threading.Event()

    def count() -> None:
        nonlocal steps
        while not flown.is_set():
            steps += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = steps
    ringwing.run("paper-4.1", set={"time.duration_s": 30}, record=False)
    during = steps - before
    flown.set()
    thread.join()
    assert during > 5


def interrupted(code: str, folder: Path, ready: Path) -> subprocess.CompletedProcess[str]:
    """Runs `code`, and sends SIGINT once `ready` exists."""
    child = subprocess.Popen([sys.executable, "-c", code], cwd=folder, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not list(folder.glob(str(ready))) and time.monotonic() < deadline and child.poll() is None:
        time.sleep(0.01)
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=60)
    return subprocess.CompletedProcess(child.args, child.returncode, None, errors)


def test_ctrl_c_ends_a_flight_in_order(tmp_path: Path) -> None:
    code = "import ringwing; ringwing.run('paper-4.1', set={'time.duration_s': 36000})"
    ended = interrupted(code, tmp_path, Path("runs/*/layout.json"))
    assert ended.stderr.rstrip().endswith("KeyboardInterrupt"), ended.stderr
    log = ringwing.Log(tmp_path / "runs" / "latest")
    assert log.summary["verdict"] == "failed" and log.problems == []
    assert "run.interrupted" in log.events["kind"]


def test_ctrl_c_ends_a_sweep(tmp_path: Path) -> None:
    code = (
        "import pathlib, ringwing\n"
        "ringwing.sweep('paper-4.1', set={'time.duration_s': 20}, seeds=100000, progress=lambda *_: pathlib.Path('flies').touch())"
    )
    ended = interrupted(code, tmp_path, Path("flies"))
    assert ended.stderr.rstrip().endswith("KeyboardInterrupt"), ended.stderr


def test_real_processes_fly_the_same_flight(tmp_path: Path, command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RINGWING", command)
    wanted = {"scenario": "paper-4.1", "set": {**SHORT, "seed": 9}, "faults": ["at 1 s kill uav 2"]}
    defaults = tmp_path / "ringwing.toml"
    defaults.write_text('law = "resilient"')
    monkeypatch.setenv("RINGWING_CONFIG", str(defaults))
    real = ringwing.run(**wanted, simulated=False, out=tmp_path)
    simulated = ringwing.run(**wanted, record=False)
    assert (real.payload_hash, real.summary["flight"]) == (simulated.payload_hash, simulated.summary["flight"])
    assert real.log.timing.rows == real.summary["ticks"] + 1
    unrecorded = ringwing.run(**wanted, simulated=False, record=False)
    assert (unrecorded.payload_hash, unrecorded.folder) == (real.payload_hash, None)
    with pytest.raises(ringwing.ScenarioError, match="paper-4.3"):
        ringwing.run("paper-4.3", simulated=False, out=tmp_path)


def test_without_the_command_real_processes_are_refused_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RINGWING", "/nowhere/ringwing")
    with pytest.raises(ringwing.FlightError, match="names no program: build it"):
        ringwing.run("paper-4.1", simulated=False)
