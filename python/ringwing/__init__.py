"""Read, fly and sweep ringwing's swarm flights.

``Log`` reads what a flight has recorded into NumPy columns. ``run`` flies one scenario, ``sweep`` flies it at many values of
some axes. ``Controller`` is a control law of your own, which ``fly`` or the command ``ringwing`` flies. Positions are in metres in the local frame (x east, y north), angles in radians, counterclockwise from the x axis, and
times in seconds of simulated time; the name of every column ends with its SI unit.
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

#: The version of ringwing that reads and flies.
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
