"""Control laws of your own, for some or all UAVs of a flight."""

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
    """What a controller may know before the flight."""

    def __init__(self, uav: int, scenario: str, arguments: list[str]) -> None:
        #: The UAV that it will fly, from 1.
        self.uav = uav
        #: The arguments of the program that are its own; empty in ``fly``.
        self.arguments = arguments
        self._scenario = scenario

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """The whole scenario, as in the log: ``start.scenario["formation"]["spacing_m"]``."""
        value: dict[str, Any] = json.loads(self._scenario)
        return value


class Controller:
    """A control law for one UAV. Derive from it, and write ``step``.

    Each UAV has a controller of its own. An agent that is killed and started again begins with a new one.
    """

    def __init__(self, start: Start) -> None:
        """Begins with what is known before the flight. A class with an ``__init__`` of its own takes the same argument."""

    def step(self, situation: Situation) -> Wish:
        """Decides what to fly until the next tick.

        It is called once a tick, in order of ticks, except in ticks in which the agent does not know where its UAV is or was frozen. In
        lockstep, a flight repeats to the bit if the same situations in the same order give the same wishes.
        """
        raise NotImplementedError(f"{type(self).__name__} has no step")


#: Makes the controller of a UAV: a class, or any function of a ``Start``.
MakeController = Callable[[Start], Controller]


def main(make: MakeController) -> None:
    """Flies one UAV until the flight ends; the last line of a program that ringwing starts.

    ``ringwing run paper-4.1 --agent "3=python3 mine.py"`` starts such a program and tells it in its arguments which UAV of which run it
    flies. An exception in the controller is printed and ends the program: its UAV goes into its failsafe.

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
    """Flies a simulation in this process, in which controllers in Python fly some or all UAVs.

    The flight equals one in which a process flies each of these UAVs with the same controller, to the bit. An exception of a controller
    ends the flight and comes out of this call.

    Args:
        scenario: Name of a preset, such as ``"dropout"``, or the path of a scenario file.
        controllers: For each UAV that does not fly the built-in law, what makes its controller: ``{3: Mine}``. A class or function alone
            is for all UAVs.
        set: Keys of the scenario with their values: ``{"seed": 7, "control.law": "resilient"}``.
        faults: Sentences such as ``"at 30 s kill uav 3"``.
        record: Write the log. Without it nothing is written.
        out: Folder in which the run makes its own folder.

    Raises:
        ScenarioError: A line for each mistake in the scenario, the keys and the faults.
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
    """What the log calls the controller: there is no command that could start it again."""
    return f"{getattr(make, '__module__', '?')}.{getattr(make, '__qualname__', type(make).__name__)}"


def _from_parts(make: MakeController) -> Callable[[int, str, list[str]], Controller]:
    return lambda uav, scenario, arguments: make(Start(uav, scenario, arguments))
