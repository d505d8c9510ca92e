"""Single flights."""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from . import _native
from ._command import fly_processes
from ._log import Log
from ._scenario import sentences, settings


class ScenarioWarning(UserWarning):
    """A fault of the scenario can have no effect, or rounding to whole ticks changes it noticeably."""


class Run:
    """A flight that is over."""

    def __init__(self, summary: dict[str, Any], folder: Path | None) -> None:
        #: The flight in numbers, as in ``summary.json``: ``summary["settling_s"]``. A value that does not exist is ``None``.
        self.summary = summary
        #: The folder of the run; ``None`` if it was not recorded.
        self.folder = folder

    @property
    def passed(self) -> bool:
        """Whether the flight met every requirement of its scenario."""
        return self.verdict == "passed"

    @property
    def verdict(self) -> str:
        """``"passed"``, ``"violated"`` (a requirement) or ``"failed"`` (it did not fly to its end)."""
        return str(self.summary["verdict"])

    @property
    def payload_hash(self) -> str | None:
        """The hash of all payloads. Equal hashes mean equal flights."""
        value: str | None = self.summary["payload_hash"]
        return value

    @cached_property
    def log(self) -> Log:
        """The log of the flight.

        Raises:
            ValueError: The flight was not recorded.
        """
        if self.folder is None:
            raise ValueError("this flight was not recorded: fly it with record=True")
        return Log(self.folder)

    def __repr__(self) -> str:
        return f"<Run of {self.summary['scenario']}: {self.verdict}>"


def run(
    scenario: str | os.PathLike[str] = "paper-4.2",
    *,
    set: Mapping[str, Any] | None = None,
    faults: Iterable[str] | None = None,
    simulated: bool = True,
    record: bool = True,
    out: str | os.PathLike[str] = "runs",
) -> Run:
    """Flies a scenario to its end.

    Ctrl-C ends the flight in order: its log is whole, its verdict ``failed``, and ``KeyboardInterrupt`` is raised. Other threads run
    meanwhile.

    Args:
        scenario: Name of a preset, such as ``"dropout"``, or the path of a scenario file.
        set: Keys of the scenario with their values: ``{"seed": 7, "control.law": "resilient"}``.
        faults: Sentences such as ``"at 30 s kill uav 3"``.
        simulated: Fly in this process, without shared memory. Otherwise the command ``ringwing`` starts a process for each UAV: it is
            looked for in the environment variable ``RINGWING``, then on the path. Both fly the same to the bit, unless
            ``time.real_time`` is set.
        record: Write the log. Without it nothing is written, and a simulated flight is about twice as fast.
        out: Folder in which the run makes its own folder.

    Raises:
        ScenarioError: A line for each mistake in the scenario, the keys and the faults.
        FlightError: The flight cannot begin, or its folder cannot be written.
    """
    keys, words = settings(set), sentences(faults)
    if simulated:
        folder, text, notes = _native.fly(os.fspath(scenario), keys, words, [], out if record else None)
        for note in notes:
            warnings.warn(note, ScenarioWarning, stacklevel=2)
        return Run(json.loads(text), None if folder is None else Path(folder))
    if record:
        return Run(*fly_processes(os.fspath(scenario), keys, words, Path(out), record=True))
    with tempfile.TemporaryDirectory() as nowhere:
        summary, _ = fly_processes(os.fspath(scenario), keys, words, Path(nowhere), record=False)
        return Run(summary, None)
