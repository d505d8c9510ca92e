"""Many flights."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._scenario import sentences, settings, toml
from ._table import Table, of_raw


class Sweep:
    """The results of a sweep."""

    def __init__(self, flights: Table, cells: Table) -> None:
        #: One row for each flight: ``cell``, ``seed``, the axes, ``verdict``, ``violated`` (keys of requirements, separated by spaces),
        #: every figure of the summary, ``payload_hash``, and ``failure``, which says why the flight could not be flown.
        self.flights = flights
        #: One row for each cell: ``cell``, the axes, ``flights``, ``passed``, and ``success`` with its 95 % Wilson interval from
        #: ``success_low`` to ``success_high``. Each figure has its median, and in ``..._bad`` the value that one flight in ten exceeds on
        #: the bad side. A flight that lacks a figure counts as worse than all others; if such a flight decides a value, the value is NaN.
        self.cells = cells

    def __repr__(self) -> str:
        return f"<Sweep of {self.cells.rows} cells, {self.flights.rows} flights>"


def sweep(
    scenario: str | os.PathLike[str],
    *,
    axes: Mapping[str, str | Sequence[Any] | NDArray[Any]] | None = None,
    set: Mapping[str, Any] | None = None,
    faults: Iterable[str] | None = None,
    agents: Mapping[int | str, Sequence[str]] | None = None,
    seeds: int | None = None,
    first_seed: int | None = None,
    precision: float | None = None,
    seeds_max: int | None = None,
    combination: str | None = None,
    sampling: str | None = None,
    samples: int | None = None,
    jobs: int | None = None,
    figures: Iterable[str] = ("slot_error_max_m", "settling_s", "recovery_max_s", "closest_pair_m"),
    progress: Callable[[int, int], object] | None = None,
) -> Sweep:
    """Flies a scenario with many values of some axes and many seeds, in this process and on all cores.

    The flights and the rows are the same as those of the command ``ringwing sweep``. This function keeps nothing on disk. For a sweep
    that takes hours, use the command: it keeps its results in a folder, and continues after it was killed. Ctrl-C ends the sweep after
    the flights in the air have ended. Other Python threads run during the sweep.

    Args:
        scenario: A preset or a scenario file, to which axes are added; or a built-in sweep such as ``"delay-loss"``, or a sweep file.
        axes: For each axis a list of values, or a text such as ``"0, 0.1 .. 1.0"`` or ``"uniform 0 .. 2"``. The name of an axis is a key
            of the scenario, or a name that a fault has in braces.
        set: Keys of the scenario that every cell sets.
        faults: Fault sentences. Braces in a sentence contain the name of an axis, ``"at 30 s link all->all delay {delay} s"``, or the
            values of a new axis, ``"... loss {0, 10 .. 50} %"``.
        agents: Programs that fly UAVs with a control law of your own, each with its arguments: ``{3: ["python3", "mine.py"]}``, or
            ``{"all": ["./consensus"]}``. Each flight starts the program anew, once for each of these UAVs. Controllers in this
            process would have to wait for one another, so a sweep does not take any.
        seeds: Number of flights in each cell (1).
        first_seed: The first seed of each cell (1).
        precision: If given, each cell is flown until the 95 % interval of its success is this narrow.
        seeds_max: The maximum number of flights in a cell if ``precision`` is given.
        combination: ``"grid"``, ``"zip"`` or ``"one-at-a-time"``.
        sampling: How random axes are drawn: ``"independent"`` or ``"latin-hypercube"``.
        samples: Number of samples of the random axes.
        jobs: Number of flights at the same time; by default the number of cores.
        figures: The figures for which ``cells`` has columns.
        progress: A function that is called when flights have ended. Its arguments are the number of flights that have ended, and the
            maximum number of flights of the sweep.

    Raises:
        ScenarioError: The sweep has mistakes. The message has a line for each. All cells are checked before the first flight.
    """
    options: _native.Options = {
        "combination": combination,
        "sampling": sampling,
        "samples": samples,
        "seeds": seeds,
        "first_seed": first_seed,
        "precision": precision,
        "seeds_max": seeds_max,
        "jobs": jobs,
        "figures": list(figures),
        "agents": [(str(uavs), list(command)) for uavs, command in (agents or {}).items()],
    }
    named = [(name, _values(values)) for name, values in (axes or {}).items()]
    rows, cells = _native.sweep(os.fspath(scenario), named, settings(set), sentences(faults), options, progress)
    return Sweep(_table(rows), _table(cells))


def _values(values: str | Sequence[Any] | NDArray[Any]) -> str | list[str]:
    return values if isinstance(values, str) else [toml(value) for value in values]


def _table(raw: _native.RawColumns) -> Table:
    """The columns of results. The values of an axis become numbers if all of them are numbers."""
    texts = ("verdict", "violated", "payload_hash", "failure")
    columns = of_raw(raw)
    return Table({name: column if name in texts else _numbers(column) for name, column in columns.items()})


def _numbers(column: NDArray[Any]) -> NDArray[Any]:
    if column.dtype != object:
        return column
    try:
        return column.astype(np.float64)
    except ValueError:
        return column
