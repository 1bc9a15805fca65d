"""BLF and ASC: what cantools encoded is decoded, each message on its own clock; hostile containers and definitions."""

from __future__ import annotations

import struct
import sys
import zlib
from pathlib import Path

import asammdf
import can
import cantools
import numpy as np
import pytest

from livebode.core import ExtraError, RecordingError, install_command
from livebode.sources import open_log
from tests.support.command import livebode
from tests.support.errors import refused
from tests.support.recordings import Mf4Writer

DBC = """VERSION ""
NS_ :
BS_:
BU_: X
BO_ 256 Drive: 8 X
 SG_ Torque : 0|16@1- (0.1,-5) [0|0] "N m" X
 SG_ Speed : 23|16@0- (0.25,0) [0|0] "rad/s" X
 SG_ Enabled : 32|1@1+ (1,0) [0|0] "" X
BO_ 2566848512 Position: 8 X
 SG_ Angle : 0|64@1- (1,0) [0|0] "rad" X
BO_ 512 Diagnosis: 8 X
 SG_ Page M : 0|8@1+ (1,0) [0|0] "" X
 SG_ Voltage m0 : 8|16@1+ (1,0) [0|0] "V" X
SIG_VALTYPE_ 2566848512 Angle : 2;
VAL_ 256 Enabled 1 "on" 0 "off" ;
"""


WRITERS = {"a.blf": can.BLFWriter, "a.asc": can.ASCWriter, "a.mf4": Mf4Writer}
RNG = np.random.default_rng(0)
SPEED = RNG.integers(-400, 400, 500) / 4
TORQUE = RNG.integers(-100, 100, 500) / 10
ANGLE = RNG.standard_normal(500)


def frames(positions: int = 1) -> list[can.Message]:
    """Drive every 2 ms, Position 0.3 ms later on so many buses, and frames that are not signals."""
    database = cantools.database.load_string(DBC, "dbc")
    found = [can.Message(0.0, 0x7FF, is_extended_id=False, data=b"x", channel=0)]
    for k in range(500):
        drive = {"Torque": TORQUE[k], "Speed": SPEED[k], "Enabled": k % 2}
        data = database.encode_message("Drive", drive)
        found.append(can.Message(0.002 * k + 5e-10, 256, is_extended_id=False, data=data, channel=0))
        data = struct.pack("<d", ANGLE[k])
        found += [
            can.Message(0.002 * k + 0.0003 + 5e-10, 0x18FF0000, is_extended_id=True, data=data, channel=bus)
            for bus in range(positions)
        ]
    found.append(can.Message(1.0, 256, is_extended_id=False, is_remote_frame=True, dlc=8, channel=0))
    found.append(can.Message(1.0, 512, is_extended_id=False, data=bytes(8), channel=0))
    return found


def written(folder: Path, name: str, messages: list[can.Message], dbc: str = DBC) -> tuple[Path, Path]:
    (folder / "x.dbc").write_text(dbc)
    with WRITERS[name](folder / name) as writer:
        for message in messages:
            writer.on_message_received(message)
    return folder / name, folder / "x.dbc"


@pytest.mark.parametrize("name", sorted(WRITERS))
def test_signals_are_physical_and_each_message_has_its_clock(tmp_path, name):
    path, dbc = written(tmp_path, name, frames())
    log = open_log(path, dbc=dbc)
    listed = [("Drive.time", "s"), ("Drive.Torque", "N m"), ("Drive.Speed", "rad/s"), ("Drive.Enabled", "")]
    assert [(channel.name, channel.unit) for channel in log.channels] == listed
    (block,) = log.blocks(["Drive.Torque", "Speed", "Drive.Enabled"])
    np.testing.assert_allclose(block.data, [TORQUE, SPEED, np.arange(500) % 2], rtol=0, atol=1e-12)
    position = open_log(path, dbc=dbc, channels=["Position.Angle"])
    (angles,) = position.blocks()
    np.testing.assert_array_equal(angles.data, [ANGLE])
    np.testing.assert_allclose(angles.time_s - block.time_s, 0.0003, rtol=0, atol=1e-12)
    assert (log.rate_hz, position.rate_hz, position.channels[1].unit) == (500, 500, "rad")
    reasons = {one.name: one.reason for one in log.skipped}
    first = 0 if name == "a.mf4" else 1  # python-can writes its own numbers of buses into MF4
    assert reasons[f"{first}/0x7FF"] == "the DBC does not define this frame"
    assert reasons["Diagnosis"] == "its signals are multiplexed"
    with refused(RecordingError, "clocks-differ", groups=["Drive", "Position"]):
        open_log(path, dbc=dbc, channels=["Drive.Torque", "Position.Angle"])


@pytest.mark.parametrize("name", sorted(WRITERS))
def test_a_message_on_two_buses_is_two_groups(tmp_path, name):
    path, dbc = written(tmp_path, name, frames(positions=2))
    last = 1 if name == "a.mf4" else 2
    (block,) = open_log(path, dbc=dbc, channels=[f"{last}/Position.Angle"]).blocks()
    np.testing.assert_array_equal(block.data, [ANGLE])


@pytest.mark.parametrize("name", sorted(WRITERS))
def test_a_dbc_is_needed_and_only_for_frames(tmp_path, name):
    path, dbc = written(tmp_path, name, frames()[:9])
    with refused(RecordingError, "dbc-missing", path=str(path), argument="dbc"):
        open_log(path)
    with refused(RecordingError, "not-found", path=str(tmp_path / "none.dbc")):
        open_log(path, dbc=tmp_path / "none.dbc")
    with refused(RecordingError, "no-frames", path=str(dbc)):
        open_log(dbc, dbc=dbc)


def test_the_commands_take_the_dbc_as_an_option_and_from_the_configuration(tmp_path):
    path, dbc = written(tmp_path, "a.blf", frames())
    result = livebode("inspect", path)
    assert (result.code, result.err.count("\n")) == (2, 1)
    assert "set dbc to the file that defines them (option --dbc)" in result.err
    result = livebode("inspect", path, "--dbc", dbc, "--time", "Position.time")
    assert (result.code, "Position.Angle  rad" in result.out) == (0, True)
    assert "on the clock --time 'Drive.time': Drive.Torque, Drive.Speed, Drive.Enabled\n" in result.out
    (tmp_path / "axis.toml").write_text(
        '[source]\nlog = "a.blf"\ndbc = "x.dbc"\n[signals]\noutput = "Drive.Torque"\ninput = "Drive.Speed"\n'
        '[lines]\nfrequencies = "50,100"\nwindow = 100\n[tracking]\nestimator = "direct"\naccept_roles = true\n'
    )
    result = livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run")
    assert (result.code, "'Drive.Speed' does not repeat" in result.err) == (0, True)  # it is noise here


def test_mf4_gives_the_values_of_asammdf(tmp_path):
    path, dbc = written(tmp_path, "a.mf4", frames())
    log = open_log(path, dbc=dbc)
    (block,) = log.blocks(["Drive.Torque", "Drive.Speed", "Drive.time"])
    with asammdf.MDF(path) as file, file.extract_bus_logging({"CAN": [(dbc, 0)]}) as extracted:
        for name in ("Torque", "Speed"):
            signal = extracted.get(name)
            np.testing.assert_allclose(block[f"Drive.{name}"], signal.samples, rtol=0, atol=1e-12)
            np.testing.assert_array_equal(block["Drive.time"], signal.timestamps)


def test_mf4_with_frames_and_channels_has_both_and_without_frames_takes_no_dbc(tmp_path):
    path, dbc = written(tmp_path, "a.mf4", frames())
    signal = asammdf.Signal(np.arange(500.0), np.arange(500) / 1000, name="y")
    with asammdf.MDF(path) as file:
        file.append([signal], common_timebase=True)
        both = file.save(tmp_path / "b.mf4")
    log = open_log(both)
    assert [channel.name for channel in log.channels if channel.name != "time"] == ["y"]
    assert log.skipped[0].reason == "it has CAN frames, whose signals only a DBC file defines"
    assert "Drive.Torque" in [channel.name for channel in open_log(both, dbc=dbc).channels]
    with asammdf.MDF(version="4.10") as file:
        file.append([signal], common_timebase=True)
        none = file.save(tmp_path / "c.mf4")
    with refused(RecordingError, "no-frames", path=str(none)):
        open_log(none, dbc=dbc)


def test_a_frame_shorter_than_its_message_is_refused(tmp_path):
    short = [can.Message(0.001 * k, 256, is_extended_id=False, data=bytes(3), channel=0) for k in range(9)]
    path, dbc = written(tmp_path, "a.blf", short)
    with refused(RecordingError, "damaged", part="Drive"):
        list(open_log(path, dbc=dbc).blocks(["Drive.Torque"]))


def test_relative_times_and_endless_lines_of_asc_are_refused(tmp_path):
    path, dbc = written(tmp_path, "a.asc", frames())
    text = path.read_text()
    path.write_text(text.replace("timestamps absolute", "timestamps relative"))
    with refused(RecordingError, "time-irregular", path=str(path)):
        open_log(path, dbc=dbc)
    path.write_text(text + "1.5 1 " + "1" * 100_000)
    with refused(RecordingError, "too-large", path=str(path), limit=1 << 16):
        open_log(path, dbc=dbc)


HEAD = b"LOGG" + struct.pack("<L", 144) + bytes(136)


def container(content: bytes, declared: int) -> bytes:
    body = struct.pack("<H6xL4x", 2, declared) + zlib.compress(content)
    raw = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 16 + len(body), 10) + body
    return HEAD + raw + bytes(len(raw) % 4)


def message(size: int) -> bytes:
    return struct.pack("<4sHHLL", b"LOBJ", 32, 1, size, 86)


@pytest.mark.parametrize(
    ("content", "code", "facts"),
    [
        (container(bytes(1 << 24), 1 << 31), "too-large", {"limit": 1 << 26}),
        (container(bytes(1 << 24), 100), "damaged", {"byte": 144}),
        (container(message(0) + bytes(99), 115), "damaged", {"size": 0}),
        (container(message(1 << 31) + bytes(99), 115), "damaged", {"size": 1 << 31}),
        (container(message(200) + bytes(99), 115), "truncated", {}),
        (container(message(48) + bytes(99), 115), "damaged", {"byte": 144}),
        (HEAD + message(8), "damaged", {"byte": 144}),
        (HEAD + message(1 << 31), "truncated", {"byte": 144}),
        (b"LOGG" + struct.pack("<L", 1 << 31) + bytes(136), "damaged", {"size": 1 << 31}),
    ],
)
def test_containers_that_contradict_their_sizes_are_refused(tmp_path, content, code, facts):
    path = tmp_path / "a.blf"
    path.write_bytes(content)
    with refused(RecordingError, code, path=str(path), **facts):
        open_log(path, dbc=tmp_path / "x.dbc")


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("Drive: 8", "Drive: 4000000000", "too-large"),
        ("0|16@1-", "4000000000|16@1-", "too-large"),
        ("0|16@1-", "0|4000000000@1-", "too-large"),
        ("BU_: X", "BU_: [", "damaged"),
    ],
)
def test_definitions_of_hostile_size_are_refused(tmp_path, old, new, code):
    path, dbc = written(tmp_path, "a.asc", frames(), DBC.replace(old, new, 1))
    with refused(RecordingError, code, path=str(dbc)):
        open_log(path, dbc=dbc)


@pytest.mark.parametrize("package", ["can", "cantools"])
def test_frames_without_their_libraries_name_the_extra(tmp_path, monkeypatch, package):
    path, dbc = written(tmp_path, "a.blf", frames())
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ExtraError, match="which is not installed") as caught:
        open_log(path, dbc=dbc)
    assert caught.value.remedy == f"run {install_command('can')}"
