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
    """The log does not show the whole flight, for example because it is truncated."""


class Log:
    """A recorded flight.

    Reads every log that ``ringwing review`` can read, including truncated and damaged logs, and logs that other programs have sorted,
    filtered or compressed. If something is missing, ``problems`` says what, and a ``LogWarning`` is issued. A topic is read when you
    first use it, and then stays in memory.

    Args:
        path: A run's folder, the ``.mcap`` or ``.mcap.zst`` file in it, ``"latest"`` for the newest run in ``runs``, or ``"-"`` for
            standard input.

    Raises:
        LogError: The file is not a log of ringwing, or contains two flights. The message names the file and says what to do.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._native = NativeLog(path)
        self._tables: dict[tuple[str, str], dict[str, Table]] = {}
        if self.problems:
            text = "; ".join(self.problems)
            warnings.warn(f"log {self.path}: {text}", LogWarning, stacklevel=2)

    @property
    def path(self) -> Path:
        """The path of the log file."""
        return Path(self._native.path)

    @cached_property
    def problems(self) -> list[str]:
        """Why the log does not show the whole flight; empty if it does. ``summary["failures"]`` also has the problems that show
        only when every tick is read."""
        return self._native.shortfalls()[0]

    @cached_property
    def notes(self) -> list[str]:
        """What is unusual about the log, but does no harm."""
        return self._native.shortfalls()[1]

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """The scenario of the flight with every key, named as in ``ringwing scenario show``: ``scenario["formation"]["uavs"]``."""
        return _object(self._native.scenario())

    @cached_property
    def metadata(self) -> dict[str, dict[str, str]]:
        """The metadata of the file, as texts: ``run`` says what was flown, and ``result`` says how the flight ended. In a truncated log,
        ``result`` is empty."""
        run, result = self._native.metadata()
        return {"run": run, "result": result}

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The flight in numbers, measured again from the log, as ``ringwing review --json`` prints it. A value that does not exist is
        ``None``."""
        return _object(self._native.summary())

    @property
    def payload_hash(self) -> str | None:
        """The hash of all payloads. Equal hashes mean equal flights. ``None`` if the world ended before it could write the hash."""
        return self.metadata["result"].get("world.payload_hash")

    @cached_property
    def uavs(self) -> list[Uav]:
        """All UAVs, in the order of their numbers."""
        return [Uav(self, number) for number in range(1, self._native.uavs + 1)]

    def uav(self, number: int) -> Uav:
        """The UAV with this number, from 1."""
        if not 1 <= number <= self._native.uavs:
            raise IndexError(f"log {self.path}: no UAV {number}; the flight has UAVs 1 to {self._native.uavs}")
        return self.uavs[number - 1]

    @property
    def metrics(self) -> Table:
        """Figures of the whole swarm at 20 Hz: ``alive``, ``slot_error_max_m``, ``slot_error_rms_m``, ``neighbour_error_max_m``,
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
        """One row for each event: ``tick``, ``time_s``, ``kind`` (such as ``collision``), ``level``, ``uav`` and ``other_uav`` (0 if the
        event is not about a UAV), ``process``, ``obstacle``, ``x_m``, ``y_m``, ``sentence`` (of the fault), ``text``, and ``json`` with
        the whole event."""
        return self.topic("/events")

    @property
    def faults(self) -> Table:
        """Faults and their effects, one row on each change and one per second. ``lost``, ``frozen``, ``failsafe`` and ``collided`` count
        processes and UAVs; ``lost_names`` and so on are tuples of their names. ``asked`` counts the faults in force, and
        ``asked_sentences`` is a tuple of their sentences."""
        return self.topic("/faults")

    @property
    def links(self) -> Table:
        """Counts of the samples on each link with faults, since the receiver of the link started: ``link`` (``"2->3"``), ``offered``,
        ``delivered``, ``late``, ``lost``, ``duplicated``, ``in_flight``, ``corrupted``."""
        return self.topic("/links")

    @property
    def timing(self) -> Table:
        """How long each tick took by the wall clock: ``round_trip_us``, ``wake_us``, ``read_us``, ``compute_us``, ``return_us``,
        ``late_us``, ``answered``, ``reused``, ``missed_deadlines``. Simulated flights do not have this topic."""
        return self.topic("/timing")

    @property
    def topics(self) -> list[str]:
        """The topics that have messages."""
        return self._native.topics()

    def topic(self, name: str) -> Table:
        """The messages of a topic, one row for each. The first columns are ``tick`` and ``time_s``, then come all fields. The names of
        nested fields have dots, as in ``pose.position.x``.

        Raises:
            KeyError: The log has no such topic, or its messages contain lists of messages, which do not fit into columns.
        """
        return self._topic(name, name, "")

    def _topic(self, name: str, before: str, after: str) -> Table:
        """The topic ``name``. Reads all topics that begin with ``before`` and end with ``after`` at once."""
        tables = self._tables.get((before, after))
        if tables is None:
            raw = self._native.tables(before, after)
            tables = {topic: self._timed(of_raw(columns)) for topic, columns in raw.items()}
            self._tables[before, after] = tables
        if name in tables:
            return tables[name]
        reason = "holds lists of messages, which have no columns" if name in self.topics else "is not in the log"
        raise KeyError(f"log {self.path}: topic {name} {reason}; the topics are {', '.join(self.topics)}")

    @cached_property
    def _notes(self) -> dict[str, Table]:
        """The notes of each UAV that has any, by topic."""
        return {topic: self._timed(of_raw(columns)) for topic, columns in self._native.notes().items()}

    def _timed(self, columns: Mapping[str, NDArray[Any]]) -> Table:
        rest = {name: column for name, column in columns.items() if name != "tick"}
        tick = columns["tick"]
        return Table({"tick": tick, "time_s": tick / self._native.rate_hz, **rest})

    def __repr__(self) -> str:
        run = self.metadata["run"]
        return f"<Log {self.path}: {run.get('name', 'unknown')}, {self._native.uavs} UAVs>"


class Uav:
    """One UAV of a log. Its tables have one row for each tick in which the log has data about the UAV."""

    def __init__(self, log: Log, number: int) -> None:
        self._log = log
        #: Its number, from 1.
        self.number = number

    @property
    def state(self) -> Table:
        """Where the UAV is and how it flies, every tick: ``tick``, ``time_s``, ``uav``, ``x_m``, ``y_m``, ``heading_rad``, ``speed_m_s``,
        ``turn_rate_rad_s``, ``previous_distance_m``, ``next_distance_m``, ``leader_distance_m``, ``slot_x_m``, ``slot_y_m``,
        ``slot_error_m``, ``obstacle_distance_m`` (to the centre of the nearest obstacle that the UAV senses), ``mode``, which is
        ``"commanded"`` or the name of its failsafe; and in wind ``wind_x_m_s``, ``wind_y_m_s``, ``course_rad`` and ``ground_speed_m_s``;
        and where its sensors err ``measured_x_m``, ``measured_y_m``, ``measured_heading_rad``, ``measured_speed_m_s`` and
        ``measured_turn_rate_rad_s``."""
        return self._table("state")

    @property
    def control(self) -> Table:
        """What the UAV's agent commanded and why, every tick: ``speed_command_m_s``, ``turn_rate_command_rad_s``, the terms of f_i in
        metres (``neighbour_force_x_m`` of Eq. (4), also ``previous_``, ``next_``, ``centre_``, ``slot_``; ``repulsion_x_m`` of Eq. (13)),
        ``potential_m2`` (Eq. (3)), ``speed_saturated`` and ``turn_rate_saturated`` (Eq. (12)), the ages of the data used, ``living``,
        ``leader_silent``, ``slots_moving``, ``lost_fingerprint``, what the law wished before the collision filter, and
        ``wind_estimate_x_m_s`` and ``wind_estimate_y_m_s``; and where the agent believes that its UAV is elsewhere than it is
        ``estimate_x_m``, ``estimate_y_m`` and ``estimate_heading_rad``."""
        return self._table("control")

    @property
    def ages(self) -> Table:
        """The age of the data that the UAV's agent used, every tick: ``tick``, ``time_s``, ``previous_age_s``, ``next_age_s``,
        ``leader_age_s``. The ages are NaN before the first data arrived."""
        return self.control.select("tick", "time_s", "previous_age_s", "next_age_s", "leader_age_s")

    @property
    def notes(self) -> Table:
        """What the UAV's controller noted, in every tick with notes: ``tick``, ``time_s``, and a column for each name, in the order in which
        the names first came. A column is NaN where its name was not noted. Without notes, the table has no rows."""
        empty = Table({"tick": np.empty(0, dtype=np.int64), "time_s": np.empty(0)})
        return self._log._notes.get(self._topic("notes"), empty)

    def _table(self, kind: str) -> Table:
        # Read the tables of all UAVs in one pass over the file: a pass for one UAV takes as long.
        return self._log._topic(self._topic(kind), "/uav/", f"/{kind}")

    def _topic(self, kind: str) -> str:
        # ringwing writes the number with at least three digits, so that topics sort by number.
        width = max(3, len(str(len(self._log.uavs))))
        return f"/uav/{self.number:0{width}}/{kind}"

    def __repr__(self) -> str:
        return f"<Uav {self.number} of {self._log.path}>"


def _object(text: str) -> dict[str, Any]:
    value: dict[str, Any] = json.loads(text)
    return value
