"""PX4 ULog: topics with clocks of their own, instances, nested fields, dropouts, and definitions without end."""

from __future__ import annotations

import struct
import sys

import numpy as np
import pytest
import pyulog

from livebode.core import ExtraError, RecordingError, install_command
from livebode.sources import open_log
from tests.support.errors import refused
from tests.support.ulog_file import assembled, definition, dropout, parameter, sample, subscription, ulog_file

RNG = np.random.default_rng(0)


def clock(samples: int, step_us: int, first_us: int = 0) -> np.ndarray:
    return np.arange(samples, dtype=np.uint64) * step_us + first_us


def topics() -> dict[str, dict[str, np.ndarray]]:
    """Two instances of a gyro at 1 kHz and a command at 250 Hz, as many samples of each."""
    gyros = {
        name: {"timestamp": clock(500, 1000, first), "x": RNG.standard_normal(500).astype("f4")}
        for name, first in (("gyro", 17), ("gyro[1]", 400))
    }
    command = {"timestamp": clock(500, 4000), "u": RNG.standard_normal(500), "armed": np.arange(500) % 2 == 1}
    return gyros | {"command": command}


def test_each_topic_has_a_clock_of_its_own(tmp_path):
    path, given = tmp_path / "a.ulg", topics()
    path.write_bytes(ulog_file(given))
    for channel, rate_hz, topic in (("gyro.x", 1000, "gyro"), ("gyro[1].x", 1000, "gyro[1]"), ("u", 250, "command")):
        log = open_log(path, channels=[channel])
        (block,) = log.blocks()
        np.testing.assert_array_equal(block.data, [given[topic][channel.rpartition(".")[2]]])
        np.testing.assert_allclose(block.time_s, given[topic]["timestamp"] / 1e6, rtol=1e-12)
        assert (log.rate_hz, log.rate_origin) == (rate_hz, f"time column '{topic}.timestamp' in s")
    log = open_log(path)
    assert [channel.name for channel in log.channels] == ["command.timestamp", "command.u", "command.armed"]
    assert log.other_clocks == {"gyro.timestamp": ("gyro.x",), "gyro[1].timestamp": ("gyro[1].x",)}
    assert open_log(path, time="gyro[1].timestamp").channels[1].name == "gyro[1].x"
    with refused(RecordingError, "clocks-differ", groups=["gyro", "gyro[1]"]):
        open_log(path, channels=["gyro[0].x", "gyro[1].x"])
    with refused(RecordingError, "clocks-differ", channel="gyro.x", groups=["gyro", "command"]):
        log.blocks(["u", "gyro.x"])


def test_the_values_are_those_of_pyulog(tmp_path):
    path = tmp_path / "a.ulg"
    path.write_bytes(ulog_file(topics()))
    for topic in pyulog.ULog(str(path)).data_list:
        group = f"{topic.name}[{topic.multi_id}]" if topic.multi_id else topic.name
        for field, values in topic.data.items():
            (block,) = open_log(
                path, channels=[f"{group}.{field}" if topic.multi_id else f"{topic.name}.{field}"]
            ).blocks()
            np.testing.assert_array_equal(block.data[0], values / 1e6 if field == "timestamp" else values)


def nested(samples: int) -> bytes:
    """A topic with an array of a nested type, an array of numbers, a text and a number that pads."""
    data = (
        sample(3, struct.pack("<QhhhhBB", k * 1000, k, -k, 2 * k, 3 * k, ord("a"), 0) + struct.pack("<ff", k, -k))
        for k in range(samples)
    )
    fields = "uint64_t timestamp;pair[2] pairs;char key;uint8_t _padding0;float[2] f;"
    definitions = [definition("pair", "int16_t a;int16_t b;"), definition("state", fields), parameter("KP", 0.5)]
    return assembled(definitions, [subscription("state", 3), *data])


def test_nested_fields_and_arrays_go_by_their_path(tmp_path):
    (tmp_path / "a.ulg").write_bytes(nested(100))
    log = open_log(tmp_path / "a.ulg")
    paths = ["timestamp", "pairs[0].a", "pairs[0].b", "pairs[1].a", "pairs[1].b", "f[0]", "f[1]"]
    assert [channel.name for channel in log.channels] == [f"state.{path}" for path in paths]
    assert [(one.name, one.reason) for one in log.skipped] == [("state.key", "it is text")]
    assert log.scalars == {"KP": 0.5}
    (block,) = log.blocks(["pairs[1].b", "state.f[1]"])
    np.testing.assert_array_equal(block.data, [3.0 * np.arange(100), -1.0 * np.arange(100)])


def test_a_dropout_is_a_gap(tmp_path):
    """The recorder wrote nothing for 20 ms; what it reports of itself is in the time of the samples too."""
    rows = [sample(0, struct.pack("<Qd", 1000 * k, k)) for k in range(100) if not 40 <= k < 60]
    rows.insert(40, dropout(20))
    definitions = [definition("log", "uint64_t timestamp;double x;")]
    (tmp_path / "a.ulg").write_bytes(assembled(definitions, [subscription("log", 0), *rows]))
    log = open_log(tmp_path / "a.ulg")
    assert (log.timing.gaps, log.timing.missing, log.timing.first_gaps[0].sample) == (1, 20, 60)
    assert [block.start for block in log.blocks(["x"])] == [0, 60]


def test_a_log_whose_battery_was_removed_is_read_up_to_its_last_message(tmp_path):
    (tmp_path / "a.ulg").write_bytes(nested(100)[:-5])
    assert open_log(tmp_path / "a.ulg").samples == 99


STAMPED = "uint64_t timestamp;"


@pytest.mark.parametrize(
    ("definitions", "data", "code", "facts"),
    [
        ([definition("a", STAMPED + "a x;")], [subscription("a", 0)], "damaged", {"part": "a"}),
        ([definition("a", STAMPED + "b x;")], [subscription("a", 0)], "damaged", {"part": "b"}),
        ([definition("a", "double x;")], [subscription("a", 0)], "damaged", {"part": "a"}),
        ([], [subscription("a", 0)], "damaged", {"part": "a"}),
        ([definition("a", STAMPED)], [subscription("a", 0), b"\0\0\0" + bytes(90)], "damaged", {"byte": 90}),
        (
            [definition("a0", STAMPED + "double x;")]
            + [definition(f"a{k}", f"{STAMPED}a{k - 1}[60000] x;") for k in range(1, 50)],
            [subscription("a49", 0)],
            "too-large",
            {"limit": 20_000},
        ),
        (
            [definition("a", STAMPED + "double[15000] x;")],
            [subscription("a", number) for number in range(60_000)],
            "too-large",
            {"limit": 20_000},
        ),
    ],
)
def test_definitions_that_contradict_or_expand_without_end_are_refused(tmp_path, definitions, data, code, facts):
    path = tmp_path / "a.ulg"
    path.write_bytes(assembled(definitions, data))
    with refused(RecordingError, code, path=str(path), **facts):
        open_log(path)


def test_ulog_without_its_library_names_the_extra(tmp_path, monkeypatch):
    (tmp_path / "a.ulg").write_bytes(nested(3))
    monkeypatch.setitem(sys.modules, "pyulog", None)
    with pytest.raises(ExtraError, match="pyulog") as caught:
        open_log(tmp_path / "a.ulg")
    assert caught.value.remedy == f"run {install_command('ulog')}"
