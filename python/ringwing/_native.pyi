"""The native half of the package. Use the classes of ``ringwing``, which are built on it."""

import os
from collections.abc import Callable, Sequence
from typing import Protocol, TypedDict

import numpy as np
from numpy.typing import NDArray

VERSION: str

class RingwingError(Exception):
    """The base class of all errors of ringwing."""

class AgentError(RingwingError):
    """A controller's program cannot take part in a run."""

class LogError(RingwingError):
    """A file cannot be read as a log of ringwing."""

class ScenarioError(RingwingError):
    """A scenario, a key, a fault or an axis has mistakes. The message has a line for each."""

class FlightError(RingwingError):
    """A flight cannot begin, or its files cannot be written."""

Vector = NDArray[np.float64]
Numbers = NDArray[np.float64] | NDArray[np.int64] | NDArray[np.uint64] | NDArray[np.bool_]
# A column of texts: codes of shape (n,), which are indices into the list of distinct texts.
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
        """Which parts of the flight are missing in the log, and what is unusual about the log."""

    def summary(self) -> str:
        """The summary as JSON."""

    def tables(self, before: str, after: str) -> dict[str, RawColumns]:
        """The columns of all topics that begin with ``before`` and end with ``after``."""

    def notes(self) -> dict[str, RawColumns]:
        """The columns of the notes of each UAV that has any, by topic: ``tick``, and one for each name, in the order in which the names
        first came."""

class Options(TypedDict):
    """How to fly a sweep; ``ringwing.sweep`` explains each option."""

    combination: str | None
    sampling: str | None
    samples: int | None
    seeds: int | None
    first_seed: int | None
    precision: float | None
    seeds_max: int | None
    jobs: int | None
    figures: list[str]
    agents: list[tuple[str, list[str]]]

class Wish:
    """What a controller wants its UAV to fly until the next tick. ringwing cuts it to what the airframe can do. If a number is not finite,
    ringwing sends no command to the airframe.

    ``notes`` are numbers with names for the log, such as ``{"slot_error_m": 1.5}``; ``Log.uav(3).notes`` reads them again. They never change
    the flight. A name has 1 to 32 letters, digits and underscores of ASCII, begins with a letter, and is not ``tick``, ``time_s`` or
    ``uav``. A tick has at most 16 notes. A value may be NaN or infinite.

    Raises:
        ValueError: A note has another name, or there are more of them. The message says which one.
        TypeError: A value is no number.
    """

    def __new__(cls, speed_m_s: float, turn_rate_rad_s: float, notes: dict[str, float] | None = None) -> Wish: ...
    @property
    def speed_m_s(self) -> float:
        """The speed along the heading."""

    @property
    def turn_rate_rad_s(self) -> float:
        """The turn rate, counterclockwise."""

    @property
    def notes(self) -> dict[str, float]:
        """A copy of the notes."""

def direction(heading_rad: float) -> tuple[float, float]:
    """Cosine and sine of a heading, with the same bits on every machine.

    ``math.cos`` and ``math.sin`` use the system's library, so their last bit may differ on another machine, and then the flight differs.
    """

class Track:
    """The newest state of a UAV or of the leader that has arrived: where it was, and how it flew."""

    @property
    def tick(self) -> int: ...
    @property
    def age_s(self) -> float:
        """The age of this state. It is at least one tick, because a state takes one tick to arrive."""

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
        """``None`` before the first state of this neighbour has arrived."""

class Leader:
    """The leader, which is the centre of the formation. Position and heading are those that the UAV assumes now: from the newest state that
    has arrived, predicted as far as ``control.dead_reckoning`` says."""

    @property
    def position_m(self) -> Vector: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def track(self) -> Track: ...
    @property
    def is_silent(self) -> bool:
        """Whether no state of the leader has arrived for longer than ``membership.loss_timeout_s``."""

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
        """The obstacle repels within this distance from its centre."""

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
        """The number of the UAV; ``None`` if the aircraft is an intruder."""

class Situation:
    """Everything that a controller is told in one tick. Positions and velocities are arrays of shape (2,), x east and y north."""

    @property
    def tick(self) -> int:
        """The number of the tick. The flight begins with tick 0; tick -1 is the approach to the start states."""

    @property
    def time_s(self) -> float: ...
    @property
    def period_s(self) -> float:
        """The length of a tick."""

    @property
    def uav(self) -> int: ...
    @property
    def position_m(self) -> Vector:
        """The position of the UAV: as sensed, or as its agent estimates it from all sensors (``control.pose_estimated``)."""

    @property
    def heading_rad(self) -> float: ...
    @property
    def speed_m_s(self) -> float: ...
    @property
    def turn_rate_rad_s(self) -> float: ...
    @property
    def senses_age_s(self) -> float:
        """The age of what the UAV sensed last of itself; 0 unless a fault delays or loses it."""

    @property
    def previous(self) -> Neighbour | None:
        """The previous living UAV in the ring."""

    @property
    def next(self) -> Neighbour | None:
        """The next living UAV in the ring; ``None`` if it is the same as ``previous``."""

    @property
    def leader(self) -> Leader | None:
        """``None`` before the first state of the leader has arrived."""

    @property
    def slot_m(self) -> Vector | None:
        """The position of the UAV's slot; ``None`` as long as ``leader`` is ``None``."""

    @property
    def slot_offset_m(self) -> Vector:
        """The vector from the leader to the slot."""

    @property
    def slot_velocity_m_s(self) -> Vector | None: ...
    @property
    def wind_m_s(self) -> Vector:
        """The UAV's estimate of the wind: zero unless it is told the wind or estimates it. Speeds and headings of UAVs are
        through the air; velocities of the leader and of slots are over the ground."""

    @property
    def slot_turn_rate_rad_s(self) -> float | None: ...
    @property
    def radius_m(self) -> float:
        """R: the distance from the leader to the slot."""

    @property
    def obstacles(self) -> list[Obstacle]:
        """The obstacles in range, the nearest first."""

    @property
    def aircraft(self) -> list[Aircraft]:
        """The other aircraft in range, the nearest first; empty unless ``control.collision_filter`` is on."""

    @property
    def living(self) -> int:
        """The number of living UAVs, including this one."""

    @property
    def lost(self) -> list[int]:
        """The numbers of the UAVs that are lost."""

    @property
    def slots_are_moving(self) -> bool:
        """Whether the slots are moving to new places after a loss or a return."""

    @property
    def speed_min_m_s(self) -> float: ...
    @property
    def speed_max_m_s(self) -> float: ...
    @property
    def turn_rate_max_rad_s(self) -> float: ...

class MadeController(Protocol):
    """A controller, as ``Make`` returns it."""

    def step(self, situation: Situation, /) -> Wish: ...

#: Creates a controller from the number of the UAV, the scenario as JSON, and the arguments that the user gave the program.
Make = Callable[[int, str, list[str]], MadeController]

def run_agent(arguments: list[str], make: Make) -> None:
    """Flies one UAV of a run as its agent until the flight ends. ``arguments`` are all arguments of the program, without its name."""

def fly(
    scenario: str,
    set: list[tuple[str, str]],
    faults: list[str],
    controllers: Sequence[tuple[int | None, str, Make]],
    out: str | os.PathLike[str] | None,
) -> tuple[os.PathLike[str] | None, str, list[str]]:
    """Flies a scenario with these controllers. A controller without a number flies all UAVs. Returns the folder, the summary as JSON, and
    warnings about faults."""

def sweep(
    base: str,
    axes: list[tuple[str, str | list[str]]],
    set: list[tuple[str, str]],
    faults: list[str],
    options: Options,
    progress: Callable[[int, int], object] | None,
) -> tuple[RawColumns, RawColumns]:
    """Flies a sweep. Returns the columns of its flights and of its cells."""
