"""Logs of flights."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._native import NativeLog
from ._table import Table, of_raw


class LogWarning(UserWarning):
    """A log does not show the whole flight, for instance because it is truncated."""


class Log:
    """A recorded flight.

    Reads what ``ringwing review`` reads, and as far as that does: truncated and damaged logs, logs that other programs have sorted,
    filtered or compressed. What is missing is in ``problems`` and raises a ``LogWarning``. Topics are read when they are first asked
    for, and kept.

    Args:
        path: A run's folder, the ``.mcap`` or ``.mcap.zst`` file in it, ``"latest"`` for the newest run in ``runs``, or ``"-"`` for
            standard input.

    Raises:
        LogError: The file is not a log of ringwing, or holds two flights. The message names the file and says what to do.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._native = NativeLog(path)
        self._tables: dict[tuple[str, str], dict[str, Table]] = {}
        if self.problems:
            text = "; ".join(self.problems)
            warnings.warn(f"log {self.path}: {text}", LogWarning, stacklevel=2)

    @property
    def path(self) -> Path:
        """The file."""
        return Path(self._native.path)

    @cached_property
    def problems(self) -> list[str]:
        """Why the log does not show the whole flight; empty if it does. ``summary["failures"]`` also has what the ticks tell."""
        return self._native.shortfalls()[0]

    @cached_property
    def notes(self) -> list[str]:
        """What is unusual about the log, but hinders nothing."""
        return self._native.shortfalls()[1]

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """The scenario that was flown, with every key, as ``ringwing scenario show`` has it: ``scenario["formation"]["uavs"]``."""
        return _object(self._native.scenario())

    @cached_property
    def metadata(self) -> dict[str, dict[str, str]]:
        """The metadata of the file, as texts: ``run`` says what flies, ``result`` how it went. The latter is empty in a log that was
        cut."""
        run, result = self._native.metadata()
        return {"run": run, "result": result}

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The flight in numbers, measured again from the log: what ``ringwing review --json`` prints. A value that does not exist is
        ``None``."""
        return _object(self._native.summary())

    @property
    def payload_hash(self) -> str | None:
        """The hash of all payloads. Equal hashes mean equal flights. ``None`` if the world did not live to write it."""
        return self.metadata["result"].get("world.payload_hash")

    @cached_property
    def uavs(self) -> list[Uav]:
        """Every UAV, number 1 first."""
        return [Uav(self, number) for number in range(1, self._native.uavs + 1)]

    def uav(self, number: int) -> Uav:
        """The UAV with this number, from 1."""
        if not 1 <= number <= self._native.uavs:
            raise IndexError(f"log {self.path}: no UAV {number}; the flight has UAVs 1 to {self._native.uavs}")
        return self.uavs[number - 1]

    @property
    def metrics(self) -> Table:
        """The swarm at 20 Hz, a row for each moment: ``alive``, ``slot_error_max_m``, ``slot_error_rms_m``, ``neighbour_error_max_m``,
        ``radius_error_max_m``, ``closest_pair_m``, ``closest_adjacent_m``, ``closest_other_m``, ``clearance_m`` (to the edge of an
        obstacle), ``order`` (1 when all headings are equal), ``lyapunov_m2`` (V of Eq. (7)), ``lyapunov_rises``,
        ``saturated_share``, ``ring_pieces``, ``age_max_s``, ``age_mean_s``, ``views``, ``ring_radius_m``, ``ring_spacing_m``."""
        return self.topic("/swarm/metrics")

    @cached_property
    def leader(self) -> Table:
        """The virtual leader at 20 Hz: ``tick``, ``time_s``, ``x_m``, ``y_m``, ``heading_rad``."""
        pose = self.topic("/leader/pose")
        z, w = pose["pose.orientation.z"], pose["pose.orientation.w"]
        return Table(
            {
                "tick": pose["tick"],
                "time_s": pose["time_s"],
                "x_m": pose["pose.position.x"],
                "y_m": pose["pose.position.y"],
                # The leader turns about the vertical axis alone.
                "heading_rad": 2.0 * np.arctan2(z, w),
            }
        )

    @property
    def events(self) -> Table:
        """A row for each event: ``tick``, ``time_s``, ``kind`` (such as ``collision``), ``level``, ``uav`` and ``other_uav`` (0 where no UAV
        is concerned), ``process``, ``obstacle``, ``x_m``, ``y_m``, ``sentence`` (of the fault), ``text``, and ``json`` with the whole
        event."""
        return self.topic("/events")

    @property
    def faults(self) -> Table:
        """What is wrong, on change and at 1 Hz: ``lost``, ``frozen``, ``failsafe``, ``collided`` count processes and UAVs, ``asked`` the faults
        in force; ``lost_names`` and so on are tuples of their names, ``asked_sentences`` of the faults' sentences."""
        return self.topic("/faults")

    @property
    def links(self) -> Table:
        """Counts of the samples on each link with faults, each since its receiver started: ``link`` (``"2->3"``), ``offered``,
        ``delivered``, ``late``, ``lost``, ``duplicated``, ``in_flight``, ``corrupted``."""
        return self.topic("/links")

    @property
    def timing(self) -> Table:
        """How long each tick took by the wall clock: ``round_trip_us``, ``wake_us``, ``read_us``, ``compute_us``, ``return_us``, ``late_us``,
        ``answered``, ``reused``, ``missed_deadlines``. Simulated flights have none."""
        return self.topic("/timing")

    @property
    def topics(self) -> list[str]:
        """The topics that have messages."""
        return self._native.topics()

    def topic(self, name: str) -> Table:
        """The messages of a topic, a row each: first ``tick`` and ``time_s``, then every field. Fields of nested messages are named with
        dots, as in ``pose.position.x``.

        Raises:
            KeyError: The log has no such topic, or its messages hold lists of messages, which have no columns.
        """
        return self._topic(name, name, "")

    def _topic(self, name: str, before: str, after: str) -> Table:
        """The topic, read together with all others that begin and end like this."""
        tables = self._tables.get((before, after))
        if tables is None:
            raw = self._native.tables(before, after)
            tables = {topic: self._timed(of_raw(columns)) for topic, columns in raw.items()}
            self._tables[before, after] = tables
        if name in tables:
            return tables[name]
        reason = "holds lists of messages, which have no columns" if name in self.topics else "is not in the log"
        raise KeyError(f"log {self.path}: topic {name} {reason}; the topics are {', '.join(self.topics)}")

    def _timed(self, columns: Mapping[str, NDArray[Any]]) -> Table:
        rest = {name: column for name, column in columns.items() if name != "tick"}
        tick = columns["tick"]
        return Table({"tick": tick, "time_s": tick / self._native.rate_hz, **rest})

    def __repr__(self) -> str:
        run = self.metadata["run"]
        return f"<Log {self.path}: {run.get('name', 'unknown')}, {self._native.uavs} UAVs>"


class Uav:
    """One UAV of a log. Its tables have a row for each tick in which the log has it."""

    def __init__(self, log: Log, number: int) -> None:
        self._log = log
        #: Its number, from 1.
        self.number = number

    @property
    def state(self) -> Table:
        """Where it is and how it flies, every tick: ``tick``, ``time_s``, ``uav``, ``x_m``, ``y_m``, ``heading_rad``, ``speed_m_s``,
        ``turn_rate_rad_s``, ``previous_distance_m``, ``next_distance_m``, ``leader_distance_m``, ``slot_x_m``, ``slot_y_m``,
        ``slot_error_m``, ``obstacle_distance_m`` (to the centre of the nearest obstacle that it senses), and ``mode``: ``"commanded"``, or
        the name of its failsafe."""
        return self._table("state")

    @property
    def control(self) -> Table:
        """What its agent commanded and why, every tick: ``speed_command_m_s``, ``turn_rate_command_rad_s``, the terms of f_i in metres
        (``neighbour_force_x_m`` of Eq. (4), also ``previous_``, ``next_``, ``centre_``, ``slot_``; ``repulsion_x_m`` of Eq. (13)),
        ``potential_m2`` (Eq. (3)), ``speed_saturated`` and ``turn_rate_saturated`` (Eq. (12)), the ages of the data used, ``living``,
        ``leader_silent``, ``slots_moving``, ``lost_fingerprint``, and the law's wish before the collision filter."""
        return self._table("control")

    @property
    def ages(self) -> Table:
        """How old the data were that its agent used, every tick: ``tick``, ``time_s``, ``previous_age_s``, ``next_age_s``, ``leader_age_s``; NaN
        before the first data arrived."""
        return self.control.select("tick", "time_s", "previous_age_s", "next_age_s", "leader_age_s")

    def _table(self, kind: str) -> Table:
        # As ringwing names topics: at least three digits, so that they sort by number.
        width = max(3, len(str(len(self._log.uavs))))
        # One pass over the file for all UAVs: a pass takes as long for one as for all.
        return self._log._topic(f"/uav/{self.number:0{width}}/{kind}", "/uav/", f"/{kind}")

    def __repr__(self) -> str:
        return f"<Uav {self.number} of {self._log.path}>"


def _object(text: str) -> dict[str, Any]:
    value: dict[str, Any] = json.loads(text)
    return value
