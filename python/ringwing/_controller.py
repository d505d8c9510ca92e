"""Your own control laws, for some or all UAVs of a flight."""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from . import _native
from ._native import Situation, Wish
from ._run import Run, ScenarioWarning
from ._scenario import sentences, settings


class Start:
    """What a controller gets before the flight."""

    def __init__(self, uav: int, scenario: str, arguments: list[str]) -> None:
        #: The number of the UAV that the controller will fly, from 1.
        self.uav = uav
        #: The arguments that you gave the program, without those that ringwing adds; empty in ``fly``.
        self.arguments = arguments
        self._scenario = scenario

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """The whole scenario, as in the log. For example, ``start.scenario["formation"]["spacing_m"]`` is L."""
        value: dict[str, Any] = json.loads(self._scenario)
        return value


class Controller:
    """A control law for one UAV. Derive from this class and write ``step``.

    Each UAV has its own controller object. If an agent is killed and started again, it begins with a new one.
    """

    def __init__(self, start: Start) -> None:
        """Called before the flight. If your class has its own ``__init__``, it must take the same argument."""

    def step(self, situation: Situation) -> Wish:
        """Decides what to fly until the next tick.

        ringwing calls this once per tick, in the order of the ticks. It leaves out ticks in which the agent does not know where its UAV
        is, or was frozen. In lockstep, a flight repeats bit for bit if ``step`` returns the same wishes for the same sequence of
        situations.
        """
        raise NotImplementedError(f"{type(self).__name__} has no step")


#: Creates the controller of a UAV: a class, or any function that takes a ``Start``.
MakeController = Callable[[Start], Controller]


def main(make: MakeController) -> None:
    """Flies one UAV until the flight ends. Call it in the last line of a program that ringwing starts.

    ``ringwing run paper-4.1 --agent "3=python3 mine.py"`` starts such a program. The arguments that ringwing adds say which UAV of which
    run it flies. If the controller raises an exception, the program prints it and ends, and the UAV goes into its failsafe.

    Raises:
        AgentError: The program cannot take part in the run.
    """
    _native.run_agent(sys.argv[1:], _from_parts(make))


def fly(
    scenario: str | os.PathLike[str] = "paper-4.1",
    *,
    controllers: Mapping[int, MakeController] | MakeController,
    set: Mapping[str, Any] | None = None,
    faults: Iterable[str] | None = None,
    record: bool = True,
    out: str | os.PathLike[str] = "runs",
) -> Run:
    """Flies a simulation in this process. Controllers in Python fly some or all UAVs.

    The flight is identical, bit for bit, to one in which each of these UAVs has a process with the same controller. If a controller
    raises an exception, the flight ends and ``fly`` raises that exception.

    Args:
        scenario: Name of a preset, such as ``"dropout"``, or the path of a scenario file.
        controllers: For each UAV that does not fly the built-in law, the class or function that creates its controller: ``{3: Mine}``.
            If you give a class or function without a number, it creates the controllers of all UAVs.
        set: Keys of the scenario with their values: ``{"seed": 7, "control.law": "resilient"}``.
        faults: Sentences such as ``"at 30 s kill uav 3"``.
        record: Whether to write the log. If not, nothing is written to disk.
        out: Folder in which the run creates its own folder.

    Raises:
        ScenarioError: The scenario, the keys or the faults have mistakes. The message has a line for each.
        FlightError: The flight cannot begin, or its folder cannot be written.
    """
    by_uav: list[tuple[int | None, MakeController]]
    by_uav = list(controllers.items()) if isinstance(controllers, Mapping) else [(None, controllers)]
    chosen = [(uav, _name(make), _from_parts(make)) for uav, make in by_uav]
    folder, text, notes = _native.fly(
        os.fspath(scenario), settings(set), sentences(faults), chosen, out if record else None
    )
    for note in notes:
        warnings.warn(note, ScenarioWarning, stacklevel=2)
    return Run(json.loads(text), None if folder is None else Path(folder))


def _name(make: MakeController) -> str:
    """The name of the controller for the log, which otherwise has the command of the controller's program."""
    return f"{getattr(make, '__module__', '?')}.{getattr(make, '__qualname__', type(make).__name__)}"


def _from_parts(make: MakeController) -> Callable[[int, str, list[str]], Controller]:
    return lambda uav, scenario, arguments: make(Start(uav, scenario, arguments))
