"""Controllers in Python: in simulations, and as processes of a run."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import ringwing

PAPER = Path(__file__).parents[2] / "examples" / "controllers" / "paper.py"
SHORT = {"time.duration_s": 3}


def paper() -> type[ringwing.Controller]:
    """The controller of the example."""
    spec = importlib.util.spec_from_file_location("paper", PAPER)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    controller: type[ringwing.Controller] = module.Paper
    return controller


class Straight(ringwing.Controller):
    def step(self, situation: ringwing.Situation) -> ringwing.Wish:
        return ringwing.Wish(situation.speed_m_s, 0.0)


@pytest.mark.parametrize("scenario", ["paper-4.1", "paper-4.2"])
def test_the_papers_law_in_python_flies_as_the_built_in_one_does(scenario: str, tmp_path: Path) -> None:
    python = ringwing.fly(scenario, controllers=paper(), out=tmp_path)
    built_in = ringwing.run(scenario, out=tmp_path)
    assert python.passed and built_in.passed
    for uav in range(1, 7):
        errors = [run.log.uav(uav).state["slot_error_m"] for run in (python, built_in)]
        assert len(errors[0]) == len(errors[1]) > 5000
        # The payloads differ, because the log of a controller of one's own has no terms of the law.
        assert np.array_equal(errors[0], errors[1])


def test_a_controller_is_told_what_its_uav_knows() -> None:
    told: list[ringwing.Situation] = []

    class Curious(Straight):
        def step(self, situation: ringwing.Situation) -> ringwing.Wish:
            told.append(situation)
            return super().step(situation)

    ringwing.fly("paper-4.1", controllers={2: Curious}, set=SHORT, record=False)
    first, last = told[0], told[-1]
    assert (first.tick, first.uav, first.leader, first.slot_m) == (-1, 2, None, None)
    assert [situation.tick for situation in told] == list(range(-1, 301))
    assert last.time_s == 3.0 and last.period_s == 0.01 and last.senses_age_s == 0.0
    assert last.previous is not None and last.next is not None and last.leader is not None
    assert (last.previous.uav, last.next.uav, last.living, last.lost) == (1, 3, 6, [])
    assert last.next.track is not None and last.next.track.age_s == pytest.approx(0.01)
    assert last.slot_m is not None and last.slot_m.shape == (2,)
    assert np.allclose(last.slot_m - last.leader.position_m, last.slot_offset_m)
    flown_m = np.linalg.norm(last.position_m - first.position_m)
    assert flown_m == pytest.approx(last.speed_m_s * 3.01, rel=1e-6)


def test_a_new_agent_has_a_new_controller_and_a_scenario_to_read() -> None:
    starts: list[ringwing.Start] = []

    class Remembering(Straight):
        def __init__(self, start: ringwing.Start) -> None:
            starts.append(start)

    faults = ["at 1 s restart uav 3 after 0.5 s"]
    ringwing.fly("paper-4.1", controllers={3: Remembering}, set=SHORT, faults=faults, record=False)
    assert [start.uav for start in starts] == [3, 3]
    assert starts[0].scenario["formation"]["uavs"] == 6 and starts[0].arguments == []


def test_an_exception_of_a_controller_ends_the_flight_and_comes_out_of_it(tmp_path: Path) -> None:
    class Failing(Straight):
        def step(self, situation: ringwing.Situation) -> ringwing.Wish:
            if situation.time_s > 1:
                raise ZeroDivisionError("no idea")
            return super().step(situation)

    class Wrong(Straight):
        def step(self, situation: ringwing.Situation) -> ringwing.Wish:
            return (15.0, 0.0)  # type: ignore[return-value]

    with pytest.raises(ZeroDivisionError, match="no idea"):
        ringwing.fly("paper-4.1", controllers={3: Failing}, out=tmp_path)
    assert ringwing.Log(tmp_path / "latest").uav(3).state["tick"][-1] < 110
    with pytest.raises(TypeError, match="step returned tuple: return ringwing.Wish"):
        ringwing.fly("paper-4.1", controllers={3: Wrong}, record=False)
    with pytest.raises(NotImplementedError, match="Controller has no step"):
        ringwing.fly("paper-4.1", controllers={3: ringwing.Controller}, record=False)
    with pytest.raises(ringwing.ScenarioError, match="there is no UAV 9"):
        ringwing.fly("paper-4.1", controllers={9: Straight}, record=False)


def flown(command: str, folder: Path, *words: str) -> tuple[dict[str, object], str]:
    """The summary of a run of processes, and what it printed."""
    environment = {"RINGWING_CONFIG": "", "PATH": "/usr/bin:/bin"}
    run = subprocess.run(
        [command, "run", *words, "--out", str(folder)], capture_output=True, text=True, timeout=300, env=environment
    )
    summary: dict[str, object] = json.loads((folder / "latest" / "summary.json").read_text())
    return summary, run.stderr


def test_processes_fly_a_controller_as_the_simulation_does(command: str, tmp_path: Path) -> None:
    agent = f"2, 5={sys.executable} {PAPER}"
    summary, errors = flown(command, tmp_path, "paper-4.1", "--duration", "20", "--agent", agent)
    Paper = paper()
    controllers, short = {2: Paper, 5: Paper}, {"time.duration_s": 20}
    simulated = ringwing.fly("paper-4.1", controllers=controllers, set=short, record=False)
    assert summary["payload_hash"] == simulated.payload_hash, errors


BROKEN = """
import sys, time, ringwing

class Broken(ringwing.Controller):
    def __init__(self, start):
        self.how = start.arguments[0]

    def step(self, s):
        if s.time_s > 1:
            if self.how == "raise":
                raise ZeroDivisionError("no idea")
            if self.how == "sleep":
                time.sleep(1000)
            if self.how == "exit":
                sys.exit(3)
            if self.how == "nan":
                return ringwing.Wish(float("nan"), 0.0)
        return ringwing.Wish(s.speed_m_s, 0.0)

ringwing.main(Broken)
"""


def test_a_broken_controller_is_named_and_the_others_fly_on(command: str, tmp_path: Path) -> None:
    script = tmp_path / "broken.py"
    script.write_text(BROKEN)
    words = ["paper-4.1", "--duration", "10", "--set", "answer_timeout_s=0.5", "--set", "failsafe=hold"]
    for uav, how in enumerate(["raise", "sleep", "exit", "nan"], start=1):
        words += ["--agent", f"{uav}={sys.executable} {script} {how}"]
    summary, errors = flown(command, tmp_path / "runs", *words)
    assert summary["failures"] == [] and summary["verdict"] == "violated", errors
    for text in [
        "uav 1 gave up (exit status 1)",
        "uav 2 has not answered for 0.5 s",
        "uav 2 did not leave at the end of the flight; killed",
        "uav 3 gave up (exit status 3)",
        "uav 4 has a controller whose wish is not a finite number",
    ]:
        assert text in errors, errors
    output = (tmp_path / "runs" / "latest" / "output" / "uav-1.txt").read_text()
    assert "ZeroDivisionError: no idea" in output and "broken.py" in output
    state = ringwing.Log(tmp_path / "runs" / "latest").uav(6).state
    assert state["tick"][-1] == 1000


def test_a_controller_is_killed_frozen_and_started_again_many_times(command: str, tmp_path: Path) -> None:
    script = tmp_path / "straight.py"
    script.write_text(BROKEN)
    faults = []
    for k in range(10):
        for sentence in (f"at {2 * k + 1} s restart uav 3 after 0.5 s", f"at {2 * k + 2} s freeze uav 4 for 0.5 s"):
            faults += ["--fault", sentence]
    agent = f"3, 4={sys.executable} {script} fly"
    words = ["paper-4.1", "--law", "resilient", "--duration", "25", "--agent", agent, *faults]
    summary, errors = flown(command, tmp_path / "runs", *words)
    assert summary["failures"] == [] and summary["unplanned_losses"] == 0, errors
    assert errors.count("uav 3 is started") == 10 and errors.count("uav 4 is thawed") == 10, errors
    left = subprocess.run(["pgrep", "-f", str(script)], capture_output=True)
    assert left.stdout == b""


def test_a_sweep_starts_programs_and_flies_as_the_same_controllers_in_this_process() -> None:
    faults = ["at 2 s restart uav 2 after 0.5 s"]
    SHORT = {"time.duration_s": 4, "control.law": "resilient"}
    agents = {2: [sys.executable, str(PAPER)], "5": [sys.executable, str(PAPER)]}
    swept = ringwing.sweep("paper-4.1", agents=agents, set=SHORT, faults=faults, seeds=2, jobs=2)
    Paper = paper()
    run = ringwing.fly("paper-4.1", controllers={2: Paper, 5: Paper}, set=SHORT, faults=faults, record=False)
    assert swept.flights["payload_hash"].tolist() == [run.payload_hash] * 2


def test_a_program_that_raises_ends_its_flight_of_a_sweep_and_the_row_says_why(tmp_path: Path) -> None:
    script = tmp_path / "broken.py"
    script.write_text(BROKEN)
    swept = ringwing.sweep(
        "paper-4.1", agents={1: [sys.executable, str(script), "raise"]}, set={"time.duration_s": 2}, seeds=1
    )
    failure = swept.flights["failure"][0]
    assert "uav 1: its program ended (exit status: 1)" in failure and "ZeroDivisionError: no idea" in failure


def test_notes_that_the_log_cannot_have_are_an_error_where_they_are_made() -> None:
    wish = ringwing.Wish(15.0, 0.0, {"slot_error_m": 1.5, "gain": np.float64(2), "off": float("nan")})
    assert list(wish.notes) == ["slot_error_m", "gain", "off"] and wish.notes["gain"] == 2.0
    assert repr(ringwing.Wish(15.0, 0.0, notes={"n": 1})) == "Wish(15, 0, {'n': 1.0})"
    assert ringwing.Wish(15.0, 0.0).notes == {}
    for name in ["", "slot error", "1st", "tick", "uav", "time_s", "a" * 33]:
        with pytest.raises(ValueError, match="cannot be recorded: a name has 1 to 32 letters"):
            ringwing.Wish(15.0, 0.0, {name: 1.0})
    with pytest.raises(ValueError, match='note "n16" cannot be recorded: .* at most 16 numbers'):
        ringwing.Wish(15.0, 0.0, {f"n{number}": 0.0 for number in range(17)})
    with pytest.raises(TypeError, match='note "mode" is no number: fast'):
        ringwing.Wish(15.0, 0.0, {"mode": "fast"})  # type: ignore[dict-item]


def test_processes_and_simulation_have_the_same_notes(command: str, tmp_path: Path) -> None:
    faults = ["at 2 s restart uav 2 after 0.5 s", "at 3 s freeze uav 5 for 0.5 s"]
    agent = f"2, 5={sys.executable} {PAPER}"
    words = ["paper-4.1", "--duration", "5", "--agent", agent, *(word for one in faults for word in ("--fault", one))]
    flown(command, tmp_path, *words)
    Paper = paper()
    run = ringwing.fly("paper-4.1", controllers={2: Paper, 5: Paper}, set={"time.duration_s": 5}, faults=faults, out=tmp_path)
    processes = ringwing.Log(next(folder for folder in tmp_path.glob("paper-4.1-*") if folder != run.folder))
    for uav in (2, 5):
        notes = run.log.uav(uav).notes
        assert notes.columns == ["tick", "time_s", "formation_force_m"] and notes.rows > 400
        for column, values in notes.items():
            assert np.array_equal(values, processes.uav(uav).notes[column], equal_nan=True), (uav, column)
    without = run.log.uav(1).notes
    assert (without.columns, without.rows) == (["tick", "time_s"], 0)


def test_a_name_that_is_not_always_noted_is_nan_in_between(tmp_path: Path) -> None:
    class Counting(Straight):
        def step(self, situation: ringwing.Situation) -> ringwing.Wish:
            notes = {"tick_squared": situation.tick**2} if situation.tick % 3 else {"third": 1.0, "inf": float("inf")}
            return ringwing.Wish(situation.speed_m_s, 0.0, notes if situation.tick < 200 else None)

    run = ringwing.fly("paper-4.1", controllers={4: Counting}, set=SHORT, out=tmp_path)
    silent = ringwing.fly("paper-4.1", controllers={4: Straight}, set=SHORT, record=False)
    assert run.payload_hash == silent.payload_hash
    notes = run.log.uav(4).notes
    assert notes.columns == ["tick", "time_s", "third", "inf", "tick_squared"]
    tick = notes["tick"]
    assert np.array_equal(tick, np.arange(200))
    assert np.array_equal(notes["tick_squared"], np.where(tick % 3, tick**2, np.nan), equal_nan=True)
    assert np.array_equal(notes["inf"], np.where(tick % 3, np.nan, np.inf), equal_nan=True)
