"""Read, fly and sweep ringwing's swarm flights.

``Log`` reads the log of a flight into NumPy columns. ``run`` flies one scenario. ``sweep`` flies a scenario many times, with different
values and seeds. Derive from ``Controller`` to write your own control law; ``fly`` or the command ``ringwing`` flies it.

Positions are in metres in the local frame (x east, y north). Angles are in radians, counterclockwise from the x axis. Times are in
seconds of simulated time. The name of every column ends with its SI unit.
"""

from ._controller import Controller, Start, fly, main
from ._log import Log, LogWarning, Uav
from ._native import (
    VERSION,
    AgentError,
    Aircraft,
    FlightError,
    Leader,
    LogError,
    Neighbour,
    Obstacle,
    RingwingError,
    ScenarioError,
    Situation,
    Track,
    Wish,
    direction,
)
from ._run import Run, ScenarioWarning, run
from ._sweep import Sweep, sweep
from ._table import Table

#: The version of ringwing in this package.
version: str = VERSION
__version__ = version

__all__ = [
    "AgentError",
    "Aircraft",
    "Controller",
    "FlightError",
    "Leader",
    "Log",
    "LogError",
    "LogWarning",
    "Neighbour",
    "Obstacle",
    "RingwingError",
    "Run",
    "ScenarioError",
    "ScenarioWarning",
    "Situation",
    "Start",
    "Sweep",
    "Table",
    "Track",
    "Uav",
    "Wish",
    "direction",
    "fly",
    "main",
    "run",
    "sweep",
    "version",
]
