"""Read, fly and sweep ringwing's swarm flights.

``Log`` reads what a flight has recorded into NumPy columns. ``run`` flies one scenario, ``sweep`` flies it at many values of
some axes. Positions are in metres in the local frame (x east, y north), angles in radians, counterclockwise from the x axis, and
times in seconds of simulated time; the name of every column ends with its SI unit.
"""

from ._log import Log, LogWarning, Uav
from ._native import VERSION, FlightError, LogError, RingwingError, ScenarioError
from ._run import Run, ScenarioWarning, run
from ._sweep import Sweep, sweep
from ._table import Table

#: The version of ringwing that reads and flies.
version: str = VERSION
__version__ = version

__all__ = [
    "FlightError",
    "Log",
    "LogError",
    "LogWarning",
    "RingwingError",
    "Run",
    "ScenarioError",
    "ScenarioWarning",
    "Sweep",
    "Table",
    "Uav",
    "run",
    "sweep",
    "version",
]
