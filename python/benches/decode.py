"""How much faster `ringwing.Log` is than decoding the same messages with `mcap` and `mcap-protobuf-support`.

Both read the states and accounts of all UAVs of one log into NumPy columns. Each is timed several times, and the fastest counts.

    python benches/decode.py [LOG]

Without a log it flies paper-4.2 first. It only prints the ratio: on a busy machine no limit would tell a slow reader from a slow moment.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

import ringwing

#: Times that each way is measured. More take longer; fewer let one busy moment of the machine decide.
REPEATS = 3


def with_ringwing(path: Path) -> int:
    log = ringwing.Log(path)
    return sum(uav.state.rows + uav.control.rows for uav in log.uavs)


def with_protobuf(path: Path) -> int:
    rows = 0
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        topics = [channel.topic for channel in summary.channels.values() if channel.topic.startswith("/uav/")]
        columns: dict[str, dict[str, list[object]]] = {topic: defaultdict(list) for topic in topics}
        for _, channel, _, message in reader.iter_decoded_messages(topics=topics):
            table = columns[channel.topic]
            for field in message.DESCRIPTOR.fields:
                is_absent = field.has_presence and not message.HasField(field.name)
                table[field.name].append(np.nan if is_absent else getattr(message, field.name))
            rows += 1
    for table in columns.values():
        for name, values in table.items():
            np.array(values, dtype=object if name == "mode" else None)
    return rows


def fastest_s(read: Callable[[Path], int], path: Path) -> tuple[float, int]:
    times, rows = [], 0
    for _ in range(REPEATS):
        begin = time.perf_counter()
        rows = read(path)
        times.append(time.perf_counter() - begin)
    return min(times), rows


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(sys.argv[1]) if len(sys.argv) > 1 else ringwing.run("paper-4.2", out=folder).log.path
        (own_s, rows), (other_s, other_rows) = fastest_s(with_ringwing, path), fastest_s(with_protobuf, path)
        assert rows == other_rows, f"{rows} rows against {other_rows}"
    ratio = other_s / own_s
    print(f"{rows} messages: ringwing {own_s:.3f} s, mcap with protobuf {other_s:.3f} s, {ratio:.1f} times faster")


if __name__ == "__main__":
    main()
