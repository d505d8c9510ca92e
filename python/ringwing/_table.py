"""Columns of equal length, as NumPy arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas
    import polars

    from ._native import RawColumn, RawColumns


class Table(Mapping[str, NDArray[Any]]):
    """Columns of equal length: a mapping of names to NumPy arrays of shape ``(n,)``.

    Numbers that may be absent are ``float64`` with NaN. Texts are arrays of ``str`` objects, and lists of texts are arrays of
    tuples. ``len(table.columns)`` is the number of columns, and ``table.rows`` is the number of rows.
    """

    def __init__(self, columns: Mapping[str, NDArray[Any]]) -> None:
        lengths = {len(column) for column in columns.values()}
        if len(lengths) > 1:
            raise ValueError(f"the columns of a table have one length, not {sorted(lengths)}")
        self._columns = dict(columns)

    @property
    def columns(self) -> list[str]:
        """The names of the columns, in order."""
        return list(self._columns)

    @property
    def rows(self) -> int:
        """The number of rows."""
        return next((len(column) for column in self._columns.values()), 0)

    def __getitem__(self, name: str) -> NDArray[Any]:
        try:
            return self._columns[name]
        except KeyError:
            raise KeyError(f"no column {name!r}; the columns are {', '.join(self._columns)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def select(self, *names: str) -> Table:
        """A table with only these columns. It shares their memory with this table."""
        return Table({name: self[name] for name in names})

    def to_dict(self) -> dict[str, list[Any]]:
        """The columns as lists of Python values."""
        return {name: column.tolist() for name, column in self._columns.items()}

    def to_polars(self) -> polars.DataFrame:
        """The table as a Polars data frame; absent numbers stay NaN. Needs ``polars``."""
        import polars

        series = [
            # Polars cannot find out the type of the objects in an array.
            polars.Series(name, column.tolist() if column.dtype == object else column)
            for name, column in self._columns.items()
        ]
        return polars.DataFrame(series)

    def to_pandas(self) -> pandas.DataFrame:
        """The table as a pandas data frame. Needs ``pandas``."""
        import pandas

        return pandas.DataFrame(self._columns)

    def __repr__(self) -> str:
        return f"<Table of {self.rows} rows: {', '.join(self._columns)}>"


def of_raw(raw: RawColumns) -> dict[str, NDArray[Any]]:
    """The NumPy arrays of columns that the native module returns."""
    return {name: _array(column) for name, column in raw}


def _array(column: RawColumn) -> NDArray[Any]:
    if isinstance(column, tuple):
        codes, texts = column
        # Equal texts share one object, so each row of a long flight takes only a pointer.
        return _objects(texts)[codes]
    if isinstance(column, list):
        return _objects([tuple(texts) for texts in column])
    return column


def _objects(values: list[Any]) -> NDArray[Any]:
    """A one-dimensional array of objects. NumPy by itself would turn tuples into a second dimension."""
    array = np.empty(len(values), dtype=object)
    array[:] = values
    return array
