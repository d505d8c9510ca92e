"""The native half of the package. People use the classes of ``ringwing``, which are built on it."""

import os
from collections.abc import Callable
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

VERSION: str

class RingwingError(Exception):
    """Whatever ringwing refuses or fails at."""

class LogError(RingwingError):
    """A file cannot be read as a log of ringwing."""

class ScenarioError(RingwingError):
    """A scenario, a key, a fault or an axis is wrong. The message has a line for each mistake."""

class FlightError(RingwingError):
    """A flight cannot begin, or its files cannot be written."""

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

def fly(
    scenario: str, set: list[tuple[str, str]], faults: list[str], out: str | os.PathLike[str] | None
) -> tuple[os.PathLike[str] | None, str, list[str]]:
    """Flies a scenario; returns the folder, the summary as JSON, and warnings about faults."""

def sweep(
    base: str,
    axes: list[tuple[str, str | list[str]]],
    set: list[tuple[str, str]],
    faults: list[str],
    options: Options,
    progress: Callable[[int, int], object] | None,
) -> tuple[RawColumns, RawColumns]:
    """Flies a sweep; returns the columns of its flights and of its cells."""
