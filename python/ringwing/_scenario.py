"""Turns Python values into the keys, faults and axes of a scenario."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np


def settings(keys: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Keys with their values as TOML."""
    return [(key, toml(value)) for key, value in (keys or {}).items()]


def sentences(faults: Iterable[str] | None) -> list[str]:
    """The fault sentences as a list. Refuses a single text: otherwise each of its letters would become a fault."""
    if isinstance(faults, str):
        raise TypeError(f"faults is a list of sentences: give [{faults!r}]")
    return list(faults or [])


def toml(value: Any) -> str:
    """A value as TOML. A text stays unchanged, as in ``--set``."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(_item(item) for item in value) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_item(item)}" for key, item in value.items()) + "}"
    raise TypeError(f"{value!r} is a {type(value).__name__}: give a number, a bool, a text, a list or a dict of them")


def _item(value: Any) -> str:
    """A value inside a list or a table, where TOML requires quotes around texts."""
    return json.dumps(value) if isinstance(value, str) else toml(value)
