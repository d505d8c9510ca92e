"""The native half of the package. People use the classes of ``ringwing``, which are built on it."""

import os
from collections.abc import Callable, Sequence
from typing import Protocol, TypedDict

import numpy as np
from numpy.typing import NDArray

VERSION: str

class RingwingError(Exception):
    """Whatever ringwing refuses or fails at."""

class AgentError(RingwingError):
    """A controller's program cannot take part in a run."""

class LogError(RingwingError):
    """A file cannot be read as a log of ringwing."""

class ScenarioError(RingwingError):
    """A scenario, a key, a fault or an axis is wrong. The message has a line for each mistake."""

class FlightError(RingwingError):
    """A flight cannot begin, or its files cannot be written."""

Vector = NDArray[np.float64]
Numbers = NDArray[np.float64] | NDArray[np.int64] | NDArray[np.uint64] | NDArray[np.bool_]
# Texts are codes of shape (n,) into a list of the different ones.
Codes = tuple[NDArray[np.uint32], list[str]]
RawColumn = Numbers | Codes | list[list[str]]
RawColumns = list[tuple[str, RawColumn]]

class NativeLog:
    """An open log."""

    def __new__(cls, path: str | os.PathLike[str]) -> NativeLog: ...
    @property
    def path(self) -> os.PathLike[str]: ...
    @property
    def uavs(self) -> int: ...
    @property
    def rate_hz(self) -> int: ...
    def scenario(self) -> str:
        """The scenario as JSON."""

    def metadata(self) -> tuple[dict[str, str], dict[str, str]]:
        """The metadata ``run`` and ``result``."""

    def topics(self) -> list[str]: ...
    def shortfalls(self) -> tuple[list[str], list[str]]:
        """What the log lacks of its flight, and what is unusual about it."""

    def summary(self) -> str:
        """The summary as JSON."""

    def tables(self, before: str, after: str) -> dict[str, RawColumns]:
        """The columns of all topics that begin with ``before`` and end with ``after``."""

class Options(TypedDict):
    """How to fly a sweep; ``ringwing.sweep`` explains each."""

    combination: str | None
    sampling: str | None
    samples: int | None
    seeds: int | None
    first_seed: int | None
    precision: float | None
    seeds_max: int | None
    jobs: int | None
    figures: list[str]

class Wish:
    """What a controller wants its UAV to fly until the next tick. ringwing cuts it to what the airframe can do; a number that is not finite
    is withheld."""

    def __new__(cls, speed_m_s: float, turn_rate_rad_s: float) -> Wish: ...
    @property
    def speed_m_s(self) -> float:
        """Speed along the heading."""

    @property
    def turn_rate_rad_s(self) -> float:
        """Rate of the heading, counterclockwise."""

def direction(heading_rad: float) -> tuple[float, float]:
    """Cosine and sine of a heading, the same on every machine.

    Those of ``math`` come from the system's library, and their last bit may differ on another machine; then the flight differs with it.
    """

class Track:
    """Where a UAV or the leader was, and how it flew, in the newest state of it that has arrived."""

    @property
    def tick(self) -> int: ...
    @property
    def age_s(self) -> float:
        """How long ago that was; a state takes at least a tick to arrive."""

    @property
    def position_m(self) -> Vector: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def speed_m_s(self) -> float: ...
    @property
    def turn_rate_rad_s(self) -> float: ...
    def after(self, seconds: float) -> tuple[Vector, float]:
        """Position and heading after ``seconds`` at constant speed and turn rate."""

class Neighbour:
    """A living ring neighbour."""

    @property
    def uav(self) -> int: ...
    @property
    def rest_m(self) -> float:
        """L: the distance between its slot and this UAV's slot."""

    @property
    def track(self) -> Track | None:
        """``None`` before anything of it has arrived."""

class Leader:
    """The leader, which is the centre of the formation, where it is now: as heard, and predicted if the scenario's dead reckoning says so."""

    @property
    def position_m(self) -> Vector: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def track(self) -> Track: ...
    @property
    def is_silent(self) -> bool:
        """Whether nothing has come of it for longer than ``membership.loss_timeout_s``."""

class Obstacle:
    """An obstacle in range of the sensors."""

    @property
    def position_m(self) -> Vector: ...
    @property
    def velocity_m_s(self) -> Vector: ...
    @property
    def radius_m(self) -> float: ...
    @property
    def braking_distance_m(self) -> float:
        """Distance from the centre within which it repels."""

class Aircraft:
    """Another aircraft in range of the sensors."""

    @property
    def position_m(self) -> Vector: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def speed_m_s(self) -> float: ...
    @property
    def turn_rate_rad_s(self) -> float: ...
    @property
    def uav(self) -> int | None:
        """The number of the UAV; ``None`` for an intruder."""

class Situation:
    """Everything that a controller is told in one tick. Places and velocities are arrays of shape (2,), x east and y north."""

    @property
    def tick(self) -> int:
        """Tick 0 begins the flight; tick -1 is the approach to the start states."""

    @property
    def time_s(self) -> float: ...
    @property
    def period_s(self) -> float:
        """Length of a tick."""

    @property
    def uav(self) -> int: ...
    @property
    def position_m(self) -> Vector:
        """Where the UAV is."""

    @property
    def heading_rad(self) -> float: ...
    @property
    def speed_m_s(self) -> float: ...
    @property
    def turn_rate_rad_s(self) -> float: ...
    @property
    def senses_age_s(self) -> float:
        """Age of its newest senses; 0 unless a fault delays or loses them."""

    @property
    def previous(self) -> Neighbour | None:
        """The previous living UAV in the ring."""

    @property
    def next(self) -> Neighbour | None:
        """The next one; ``None`` if it is the same UAV."""

    @property
    def leader(self) -> Leader | None:
        """``None`` before anything of it has arrived."""

    @property
    def slot_m(self) -> Vector | None:
        """The place of the UAV's slot; ``None`` without a leader."""

    @property
    def slot_offset_m(self) -> Vector:
        """From the leader to the slot."""

    @property
    def slot_velocity_m_s(self) -> Vector | None: ...
    @property
    def slot_turn_rate_rad_s(self) -> float | None: ...
    @property
    def radius_m(self) -> float:
        """R: the distance from the centre to the slot."""

    @property
    def obstacles(self) -> list[Obstacle]:
        """The nearest first."""

    @property
    def aircraft(self) -> list[Aircraft]:
        """The nearest first; empty without ``control.collision_filter``."""

    @property
    def living(self) -> int:
        """How many UAVs are alive, this one included."""

    @property
    def lost(self) -> list[int]:
        """The UAVs that are lost."""

    @property
    def slots_are_moving(self) -> bool:
        """Whether the slots move to new places after a loss or a return."""

    @property
    def speed_min_m_s(self) -> float: ...
    @property
    def speed_max_m_s(self) -> float: ...
    @property
    def turn_rate_max_rad_s(self) -> float: ...

class MadeController(Protocol):
    """What makes controllers returns."""

    def step(self, situation: Situation, /) -> Wish: ...

#: Makes a controller from the UAV, the scenario as JSON, and the program's own arguments.
Make = Callable[[int, str, list[str]], MadeController]

def run_agent(arguments: list[str], make: Make) -> None:
    """Flies one UAV of a run as its agent until the flight ends; ``arguments`` are those of the program, without its name."""

def fly(
    scenario: str,
    set: list[tuple[str, str]],
    faults: list[str],
    controllers: Sequence[tuple[int | None, str, Make]],
    out: str | os.PathLike[str] | None,
) -> tuple[os.PathLike[str] | None, str, list[str]]:
    """Flies a scenario, with controllers for some UAVs or, without a number, for all; returns the folder, the summary as JSON, and
    warnings about faults."""

def sweep(
    base: str,
    axes: list[tuple[str, str | list[str]]],
    set: list[tuple[str, str]],
    faults: list[str],
    options: Options,
    progress: Callable[[int, int], object] | None,
) -> tuple[RawColumns, RawColumns]:
    """Flies a sweep; returns the columns of its flights and of its cells."""
