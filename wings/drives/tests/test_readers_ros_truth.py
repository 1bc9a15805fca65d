"""ROS 2 in MCAP and SQLite: what rosbags wrote is read, each topic on its own clock; hostile records and types."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from livebode.core import ExtraError, RecordingError, install_command
from livebode.sources import open_log
from tests.support.command import livebode
from tests.support.errors import refused

PLUGINS = {"a.mcap": StoragePlugin.MCAP, "a.db3": StoragePlugin.SQLITE3}
RNG = np.random.default_rng(0)
POSITION = RNG.standard_normal((300, 2))
RATE = RNG.standard_normal((300, 3))
EPOCH_NS = 1_700_000_000_123_456_789
STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE.register(
    get_types_from_msg("int16 count\nbool on\nPart[2] parts\nstring text\nfloat32[100] scan\n", "my/msg/Own")
)
STORE.register(get_types_from_msg("float32 a\nfloat64[2] b\n", "my/msg/Part"))


def made(name: str, *fields: object) -> object:
    return STORE.types[name](*fields)


def header(time_ns: int) -> object:
    return made("std_msgs/msg/Header", made("builtin_interfaces/msg/Time", *divmod(time_ns, 1_000_000_000)), "base")


def vector(values: np.ndarray) -> object:
    return made("geometry_msgs/msg/Vector3", *values.tolist())


def joint(k: int) -> object:
    """At 500 Hz, stamped by the drive."""
    stamp = header(EPOCH_NS + 2_000_000 * k)
    return made("sensor_msgs/msg/JointState", stamp, ["a", "b"], POSITION[k], np.zeros(0), np.zeros(0))


def imu(k: int) -> object:
    """A stamp that nobody set: time is that of recording, 100 Hz."""
    still, none = made("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0), np.zeros(9)
    return made("sensor_msgs/msg/Imu", header(0), still, none, vector(RATE[k]), none, vector(RATE[k]), none)


def own(k: int) -> object:
    parts = [made("my/msg/Part", k + 0.5, np.array([k, -k], float)) for _ in range(2)]
    return made("my/msg/Own", k, k % 2 == 1, parts, "text", np.zeros(100, np.float32))


def written(folder: Path, name: str, compressed: str = "") -> Path:
    bag = Writer(folder / f"bag-{name}", version=9, storage_plugin=PLUGINS[name])
    if compressed:
        bag.set_compression(CompressionMode.STORAGE, CompressionFormat[compressed])
    with bag as writer:
        for topic, build in (("/joints", joint), ("/imu", imu), ("/own", own)):
            kind = build(0).__msgtype__
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for k in range(300):
                logged_ns = EPOCH_NS + 10_000_000 * k
                writer.write(connection, logged_ns, STORE.serialize_cdr(build(k), kind))
    (found,) = (folder / f"bag-{name}").glob(f"*{Path(name).suffix}")
    return found


@pytest.mark.parametrize("name", sorted(PLUGINS))
def test_each_topic_has_its_clock_and_its_fields_by_path(tmp_path, name):
    path = written(tmp_path, name)
    joints = open_log(path, channels=["/joints.position[1]"])
    (block,) = joints.blocks()
    np.testing.assert_array_equal(block.data, [POSITION[:, 1]])
    assert [channel.name for channel in joints.channels] == ["/joints.position[0]", "/joints.position[1]"]
    assert (joints.rate_hz, joints.rate_origin) == (500, "time column '/joints.header.stamp' in ns")
    rates = open_log(path, channels=["/imu.angular_velocity.z"])
    np.testing.assert_array_equal(next(iter(rates.blocks())).data, [RATE[:, 2]])
    assert (rates.rate_hz, rates.rate_origin) == (100, "time column '/imu.logged' in ns")
    logged = open_log(path, channels=["/joints.position[0]"], time="/joints.logged")
    assert logged.rate_hz == 100
    assert open_log(path, time="/joints.logged").channels == joints.channels
    printed = livebode("inspect", path).out.split()
    assert {channel.name for channel in rates.channels} < set(printed)  # none is shortened
    with refused(RecordingError, "clocks-differ", groups=["/joints", "/imu"]):
        open_log(path, channels=["/joints.position[0]", "/imu.angular_velocity.z"])


@pytest.mark.parametrize("name", sorted(PLUGINS))
def test_types_in_the_file_are_read_and_what_is_not_a_number_is_named(tmp_path, name):
    log = open_log(written(tmp_path, name), channels=["/own.count"])
    inner = [f"/own.parts[{k}].{field}" for k in range(2) for field in ("a", "b[0]", "b[1]")]
    assert [channel.name for channel in log.channels] == ["/own.count", "/own.on", *inner]
    k = np.arange(300)
    (block,) = log.blocks(["count", "on", "parts[1].a", "/own.parts[0].b[1]"])
    np.testing.assert_array_equal(block.data, [k, k % 2, k + 0.5, -k])
    reasons = {one.name: one.reason for one in log.skipped}
    assert reasons["/own.text"] == "it is of type string"
    assert reasons["/own.scan"] == "it has 100 elements, more than 64"


def test_compressed_chunks_are_read(tmp_path):
    (block,) = open_log(written(tmp_path, "a.mcap", "ZSTD"), channels=["/joints.position[0]"]).blocks()
    np.testing.assert_array_equal(block.data, [POSITION[:, 0]])
    values = b"".join(message(struct.pack("<d", k)) for k in range(300))
    (tmp_path / "b.mcap").write_bytes(mcap("float64 x", chunk(values, len(values))))
    (block,) = open_log(tmp_path / "b.mcap", rate_hz=1, time="none").blocks()
    np.testing.assert_array_equal(block.data, [np.arange(300)])


MAGIC = b"\x89MCAP0\r\n"


def text(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


def record(kind: int, content: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(content)) + content


def mcap(
    definition: str, *data: bytes, type_: str = "my/msg/A", encoding: bytes = b"cdr", language: bytes = b"ros2msg"
) -> bytes:
    schema = struct.pack("<H", 1) + text(type_.encode()) + text(language) + text(definition.encode())
    channel = struct.pack("<HH", 1, 1) + text(b"/a") + text(encoding) + text(b"")
    return MAGIC + record(3, schema) + record(4, channel) + b"".join(data) + record(2, bytes(20)) + MAGIC


def message(content: bytes, channel: int = 1) -> bytes:
    return record(5, struct.pack("<HIQQ", channel, 0, 0, 0) + b"\0\1\0\0" + content)


def chunk(content: bytes, declared: int, compression: bytes = b"lz4") -> bytes:
    packed = lz4.frame.compress(content) if compression == b"lz4" else content
    head = struct.pack("<QQQI", 0, 0, declared, 0) + text(compression)
    return record(6, head + struct.pack("<Q", len(packed)) + packed)


IDL = "module my { module msg { struct %s { %s x; }; }; };"
RULE = "=" * 80


@pytest.mark.parametrize(
    "definition",
    [
        IDL % ("A", "double"),
        f"{RULE}\nIDL: my/msg/A\n{IDL % ('A', 'B')}\n{RULE}\nIDL: my/msg/B\n{IDL % ('B', 'double')}",
    ],
)
def test_types_in_idl_are_read(tmp_path, definition):
    values = (message(struct.pack("<d", k)) for k in range(300))
    (tmp_path / "a.mcap").write_bytes(mcap(definition, *values, language=b"ros2idl"))
    (block,) = open_log(tmp_path / "a.mcap", rate_hz=1, time="none").blocks()
    np.testing.assert_array_equal(block.data, [np.arange(300)])


def test_a_topic_of_an_unknown_type_is_skipped(tmp_path):
    (tmp_path / "a.mcap").write_bytes(mcap("", message(bytes(8)), message(bytes(8))))
    with pytest.raises(RecordingError, match="its type 'my/msg/A' is neither defined in the file nor by ROS 2"):
        open_log(tmp_path / "a.mcap", rate_hz=1)


BOMB = "".join(f"\n{'=' * 80}\nMSG: my/B{k}\nB{k + 1}[50] x" for k in range(20)) + f"\n{'=' * 80}\nMSG: my/B20\nint8 x"


@pytest.mark.parametrize(
    ("content", "code", "facts"),
    [
        (mcap("float64 x", chunk(bytes(1 << 20), 1 << 40)), "too-large", {"declared": 1 << 40}),
        (mcap("float64 x", chunk(bytes(1 << 20), 1000)), "damaged", {"declared": 1000}),
        (mcap("float64 x", chunk(b"", 1 << 20)), "too-large", {"declared": 1 << 20}),
        (mcap("float64 x", chunk(bytes(99), 99, b"own")), "damaged", {}),
        (mcap("float64 x", chunk(chunk(b"", 0), 47)), "damaged", {}),
        (mcap("float64 x", message(bytes(8), channel=2)), "damaged", {"part": 2}),
        (mcap("float64 x", message(bytes(3))), "damaged", {}),
        (mcap("float64 x", struct.pack("<BQ", 5, 1 << 60)), "truncated", {}),
        (mcap("A x", message(bytes(8))), "damaged", {"part": "my/msg/A"}),
        (mcap("B0 x" + BOMB, message(bytes(8))), "too-large", {"limit": 20_000}),
        (mcap("string[4000000000] x", message(bytes(8))), "too-large", {"limit": 20_000}),
        (mcap("float64 x", message(bytes(8)), type_="my/msg/A():\n  import os #"), "damaged", {}),
        (mcap("float64 x", message(bytes(8)), encoding=b"protobuf"), "channel-missing", {}),
        (MAGIC + MAGIC[:-1], "truncated", {}),
    ],
)
def test_records_and_types_that_contradict_or_expand_without_end_are_refused(tmp_path, content, code, facts):
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    with refused(RecordingError, code, path=str(path), **facts):
        open_log(path, rate_hz=1)


def split_bag(folder, name, pieces=3):
    """A bag whose recorder began a new file from time to time, as `ros2 bag record -d` does; files 8, 9 and 10."""
    bag = folder / "bag"
    bag.mkdir()
    suffix = Path(name).suffix
    for number, part in enumerate(np.array_split(np.arange(300), pieces), 8):
        with Writer(folder / f"part{number}", version=9, storage_plugin=PLUGINS[name]) as writer:
            topic = writer.add_connection("/joints", "sensor_msgs/msg/JointState", typestore=STORE)
            for k in part.tolist():
                writer.write(topic, EPOCH_NS + k, STORE.serialize_cdr(joint(k), "sensor_msgs/msg/JointState"))
        next((folder / f"part{number}").glob(f"*{suffix}")).rename(bag / f"bag_{number}{suffix}")
    return bag


@pytest.mark.parametrize("name", PLUGINS)
def test_the_directory_of_a_bag_is_one_recording_in_the_order_of_its_files(tmp_path, name):
    bag = split_bag(tmp_path, name)
    log = open_log(bag)
    assert (log.rate_hz, log.samples, log.path) == (500, 300, bag)
    got = np.concatenate([block["/joints.position[1]"] for block in log.blocks(["/joints.position[1]"], 77)])
    np.testing.assert_array_equal(got, POSITION[:, 1])
    assert "/joints.position[1]" in livebode("inspect", bag).out


def test_a_bag_that_is_not_complete_is_refused_with_the_file_that_is_missing(tmp_path):
    bag = split_bag(tmp_path, "a.mcap")
    (bag / "metadata.yaml").write_text("info:\n  relative_file_paths:\n    - bag_8.mcap\n    - bag_11.mcap\n")
    with refused(RecordingError, "truncated", path=str(bag), part="bag_11.mcap"):
        open_log(bag)
    (bag / "metadata.yaml").unlink()
    (bag / "bag_10.mcap").write_bytes((bag / "bag_10.mcap").read_bytes()[:-100])
    with refused(RecordingError, "truncated", path=str(bag / "bag_10.mcap")):
        open_log(bag)
    (bag / "bag_10.mcap").rename(bag / "bag_10.mcap.zstd")
    with refused(RecordingError, "not-a-file", path=str(bag / "bag_10.mcap.zstd")):
        open_log(bag)
    (bag / "bag_10.mcap.zstd").rename(bag / "bag_10.db3")
    with refused(RecordingError, "not-a-file", path=str(bag)):
        open_log(bag)
    (bag / "bag_10.db3").write_text("t,u\n0,1\n")
    for other in bag.glob("*.mcap"):
        other.unlink()
    with refused(RecordingError, "format-unknown", path=str(bag / "bag_10.db3")):
        open_log(bag)


@pytest.mark.parametrize("name", sorted(PLUGINS))
def test_ros_without_its_library_names_the_extra(tmp_path, monkeypatch, name):
    path = written(tmp_path, name)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(ExtraError, match="rosbags") as caught:
        open_log(path)
    assert caught.value.remedy == f"run {install_command('ros')}"
