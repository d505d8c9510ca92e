"""Sweeps: their rows and cells, and their mistakes."""

from __future__ import annotations

import csv
import subprocess
from pathlib import Path

import numpy as np
import pytest

import ringwing

AXES = {"control.law": ["paper", "resilient"], "delay": [0, 0.5]}
FAULTS = ["at 1 s link all->all delay {delay} s"]
SET = {"time.duration_s": 4}


@pytest.fixture(scope="module")
def delays() -> ringwing.Sweep:
    return ringwing.sweep("paper-4.1", axes=AXES, faults=FAULTS, set=SET, seeds=3, jobs=2)


def test_a_sweep_has_a_row_for_each_flight_and_for_each_cell(delays: ringwing.Sweep) -> None:
    flights, cells = delays.flights, delays.cells
    assert (flights.rows, cells.rows) == (12, 4)
    assert flights["seed"].tolist() == [1, 2, 3] * 4
    assert cells["delay"].dtype == float and sorted(set(cells["delay"])) == [0.0, 0.5]
    assert set(cells["control.law"]) == {"paper", "resilient"}
    assert cells["flights"].tolist() == [3] * 4
    assert np.all((cells["success_low"] <= cells["success"]) & (cells["success"] <= cells["success_high"]))
    assert set(flights["verdict"]) <= {"passed", "violated"}


def test_a_flight_of_a_sweep_is_that_of_a_run(delays: ringwing.Sweep) -> None:
    flights = delays.flights
    for row in (0, 11):
        run = ringwing.run(
            "paper-4.1",
            set={**SET, "control.law": flights["control.law"][row], "seed": int(flights["seed"][row])},
            faults=[f"at 1 s link all->all delay {flights['delay'][row]:g} s"] if flights["delay"][row] else [],
            record=False,
        )
        assert flights["payload_hash"][row] == run.payload_hash
        assert flights["slot_error_max_m"][row] == run.summary["slot_error_max_m"]


def test_the_rows_are_those_of_the_command(delays: ringwing.Sweep, tmp_path: Path, command: str) -> None:
    words = ["--axis", "control.law=paper, resilient", "--axis", "delay=0, 0.5", "--fault", FAULTS[0], "--seeds", "3"]
    words += ["--set", "time.duration_s=4", "--out", str(tmp_path / "out"), "--json"]
    subprocess.run([command, "sweep", "paper-4.1", *words], check=True, capture_output=True)
    with (tmp_path / "out" / "flights.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == delays.flights.columns
    assert [row["payload_hash"] for row in rows] == delays.flights["payload_hash"].tolist()


def test_ranges_and_built_in_sweeps_work_as_for_the_command() -> None:
    sweep = ringwing.sweep(
        "delay-loss", axes={"delay": "0, 0.5 .. 1", "loss": [0]}, set={"time.duration_s": 2}, seeds=1
    )
    assert sweep.cells.rows == 2 * 3


def test_progress_is_shown_and_its_exception_ends_the_sweep() -> None:
    seen: list[tuple[int, int]] = []
    ringwing.sweep("paper-4.1", set=SET, seeds=4, progress=lambda flown, of: seen.append((flown, of)))
    assert seen[-1] == (4, 4)

    def stop(flown: int, of: int) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        ringwing.sweep("paper-4.1", set=SET, seeds=100_000, progress=stop)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"axes": {"control.lwa": ["paper"]}}, r'axes\["control.lwa"\].*no such key'),
        ({"axes": {"delay": "1 .. 0"}, "faults": FAULTS}, "empty range"),
        ({"faults": ["at 1 s link all->all dleay {0, 1} s"]}, "dleay"),
        ({"axes": {"seed": [1, 2]}}, "a column of the results has this name"),
        ({"figures": ["happiness"]}, 'figure "happiness": the figures are settling_s'),
        ({"combination": "all"}, "give grid, zip or one-at-a-time"),
        ({"seeds": 0}, "seeds must be at least 1"),
    ],
)
def test_a_wrong_sweep_is_refused_before_the_first_flight(wrong: dict[str, object], reason: str) -> None:
    with pytest.raises(ringwing.ScenarioError, match=reason):
        ringwing.sweep("paper-4.1", set=SET, **wrong)  # type: ignore[arg-type]
