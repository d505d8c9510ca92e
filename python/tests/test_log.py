"""Logs: what is in them, and what is said of files that are no whole logs."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

import ringwing


def decoded(log: ringwing.Log, topic: str) -> list[object]:
    """The messages of a topic as another program decodes them."""
    with log.path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [message for _, _, _, message in reader.iter_decoded_messages(topics=[topic])]


@pytest.mark.parametrize("topic", ["/uav/002/state", "/uav/003/control", "/swarm/metrics", "/events", "/faults", "/links"])
def test_every_value_is_what_another_decoder_reads(dropout: ringwing.Run, topic: str) -> None:
    table, messages = dropout.log.topic(topic), decoded(dropout.log, topic)
    assert table.rows == len(messages) > 0
    fields = messages[0].DESCRIPTOR.fields
    assert table.columns == ["tick", "time_s", *(field.name for field in fields if field.name != "tick")]
    for field in fields:
        is_list = isinstance(table[field.name][0], tuple)
        for row, message in enumerate(messages):
            expected = getattr(message, field.name)
            if field.has_presence and not message.HasField(field.name):
                expected = np.nan
            found = table[field.name][row]
            assert (list(found) == list(expected)) if is_list else (found == expected or found != found and expected != expected)


def test_columns_are_arrays_of_one_length_with_the_types_of_their_fields(dropout: ringwing.Run) -> None:
    state, control = dropout.log.uav(1).state, dropout.log.uav(1).control
    assert state.rows == dropout.summary["ticks"] + 1 and len(state) == len(state.columns)
    assert np.array_equal(state["time_s"], state["tick"] / 100) and state["tick"].dtype == np.int64
    assert {state["x_m"].dtype, control["speed_saturated"].dtype} == {np.dtype(float), np.dtype(bool)}
    assert control["lost_fingerprint"].dtype == np.uint64
    assert set(state["mode"]) == {"commanded"}
    assert np.isnan(control["avoided_uav"]).all()


def test_a_killed_uav_flies_on_in_its_failsafe_without_an_account(dropout: ringwing.Run) -> None:
    lost = dropout.log.uav(3)
    is_failsafe = lost.state["mode"] != "commanded"
    assert 4.0 <= lost.state["time_s"][is_failsafe][0] < 6.0
    assert lost.control["time_s"].max() < 4.0
    events = dropout.log.events
    kill = events["kind"].tolist().index("fault.kill")
    assert (events["uav"][kill], events["sentence"][kill]) == (3, "kill uav 3")
    assert dropout.log.faults["lost_names"][-1] == ("uav 3",)
    assert set(dropout.log.links["link"]) == {"1->2"}


def test_ages_are_those_of_the_account(dropout: ringwing.Run) -> None:
    uav = dropout.log.uav(2)
    assert uav.ages.columns == ["tick", "time_s", "previous_age_s", "next_age_s", "leader_age_s"]
    assert uav.ages["previous_age_s"] is uav.control["previous_age_s"]
    # Half of the samples from UAV 1 are lost from 5 s to 6 s.
    during = (uav.ages["time_s"] > 5.0) & (uav.ages["time_s"] < 6.0)
    assert uav.ages["previous_age_s"][during].max() > 0.02


def test_the_leader_is_where_its_scenario_says(dropout: ringwing.Run) -> None:
    leader, scenario = dropout.log.leader, dropout.log.scenario
    assert leader["tick"][0] == 0 and np.allclose(np.diff(leader["time_s"]), 0.05)
    flown = np.hypot(np.diff(leader["x_m"]), np.diff(leader["y_m"])).sum()
    assert flown == pytest.approx(scenario["leader"]["speed_m_s"] * leader["time_s"][-1], rel=1e-6)


def test_scenario_metadata_summary_and_hash_are_those_of_the_run(dropout: ringwing.Run) -> None:
    log = dropout.log
    assert (log.scenario["seed"], log.scenario["time"]["duration_s"], len(log.scenario["faults"])) == (5, 8.0, 2)
    assert log.metadata["run"]["name"] == "paper-4.2"
    assert log.payload_hash == dropout.payload_hash == log.summary["payload_hash"]
    assert log.summary["flight"] == dropout.summary["flight"]
    assert (log.problems, log.notes) == ([], [])


def test_a_log_is_named_by_its_file_its_folder_latest_or_packed(
    dropout: ringwing.Run, in_folder: Path
) -> None:
    assert dropout.folder is not None
    packed = in_folder / "packed.mcap.zst"
    packed.write_bytes(zstandard.compress(dropout.log.path.read_bytes()))
    (in_folder / "runs").symlink_to(dropout.folder.parent)
    for name in [dropout.log.path, dropout.folder, "latest", packed]:
        assert ringwing.Log(name).payload_hash == dropout.payload_hash


def test_a_log_that_was_cut_is_read_as_far_as_it_goes_and_says_so(dropout: ringwing.Run, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    whole = dropout.log.path.read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    with pytest.warns(ringwing.LogWarning, match="cut.mcap"):
        log = ringwing.Log(cut)
    state = log.uav(1).state
    assert 0 < state.rows < dropout.log.uav(1).state.rows
    assert log.summary["verdict"] == "failed" and log.payload_hash is None
    assert any("breaks off" in failure for failure in log.summary["failures"])


def test_a_message_that_is_in_the_file_twice_is_one_row(dropout: ringwing.Run, tmp_path: Path) -> None:
    doubled = tmp_path / "doubled.mcap"
    with dropout.log.path.open("rb") as source, doubled.open("wb") as target:
        reader, writer = make_reader(source), Writer(target)
        writer.start()
        channels: dict[str, int] = {}
        for attachment in reader.iter_attachments():
            writer.add_attachment(attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, attachment.data)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for schema, channel, message in reader.iter_messages():
            if channel.topic not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, number)
            for _ in range(2):
                writer.add_message(channels[channel.topic], message.log_time, message.data, message.publish_time)
        writer.finish()
    log = ringwing.Log(doubled)
    for one, other in [(log.uav(4).state, dropout.log.uav(4).state), (log.events, dropout.log.events)]:
        assert one.to_pandas().equals(other.to_pandas())
    assert log.summary["flight"] == dropout.summary["flight"]


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("none.mcap", None, "No such file"),
        ("empty.mcap", b"", "is empty"),
        ("notes.txt", b"hello, this is a text", "is not an MCAP file"),
    ],
)
def test_what_is_not_a_log_is_refused_by_name(tmp_path: Path, name: str, content: bytes | None, reason: str) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ringwing.LogError, match=f"{name}: .*{reason}"):
        ringwing.Log(path)


def test_what_a_log_does_not_have_is_named(dropout: ringwing.Run) -> None:
    with pytest.raises(IndexError, match="no UAV 7; the flight has UAVs 1 to 6"):
        dropout.log.uav(7)
    with pytest.raises(KeyError, match="/camera is not in the log"):
        dropout.log.topic("/camera")
    with pytest.raises(KeyError, match="/swarm/state holds lists of messages"):
        dropout.log.topic("/swarm/state")
    with pytest.raises(KeyError, match="no column 'z_m'; the columns are tick, time_s"):
        dropout.log.uav(1).state["z_m"]


def test_tables_become_data_frames_of_polars_and_pandas(dropout: ringwing.Run) -> None:
    state = dropout.log.uav(3).state
    frame, other = state.to_polars(), state.to_pandas()
    assert frame.columns == list(other.columns) == state.columns
    assert frame.height == len(other) == state.rows
    assert frame["mode"].to_list() == other["mode"].to_list() == state["mode"].tolist()
    assert np.array_equal(frame["x_m"].to_numpy(), other["x_m"].to_numpy())
    faults = dropout.log.faults.to_polars()
    assert faults["lost_names"].to_list()[-1] == ["uav 3"]


def test_the_summary_is_that_of_the_command(dropout: ringwing.Run, command: str) -> None:
    review = subprocess.run([command, "review", dropout.log.path, "--json"], capture_output=True, text=True, check=False)
    assert json.loads(review.stdout) == dropout.log.summary
