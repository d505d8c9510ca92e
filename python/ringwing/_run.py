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
    """A fault of the scenario cannot have an effect, or rounding to whole ticks changes it noticeably."""


class Run:
    """A flight that has ended."""

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
        """``"passed"``, ``"violated"`` if the flight violated a requirement, or ``"failed"`` if it did not reach its end."""
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

    Ctrl-C ends the flight early: the log is still complete up to that moment, the verdict is ``failed``, and ``KeyboardInterrupt`` is
    raised. Other Python threads run during the flight.

    Args:
        scenario: Name of a preset, such as ``"dropout"``, or the path of a scenario file.
        set: Keys of the scenario with their values: ``{"seed": 7, "control.law": "resilient"}``.
        faults: Sentences such as ``"at 30 s kill uav 3"``.
        simulated: Whether to fly in this process, without shared memory. If not, the command ``ringwing`` starts a process for each UAV;
            it is the command that the environment variable ``RINGWING`` names, or else the one on the path. Both ways give the same
            flight bit for bit, unless ``time.real_time`` is set.
        record: Whether to write the log. If not, nothing is written to disk, and a simulated flight is about twice as fast.
        out: Folder in which the run creates its own folder.

    Raises:
        ScenarioError: The scenario, the keys or the faults have mistakes. The message has a line for each.
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
