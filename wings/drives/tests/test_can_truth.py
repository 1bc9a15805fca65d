"""Samples from CAN frames of drives, with the times and the faults of a real bus, compared with what was sent."""

from __future__ import annotations

import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import ConfigError, SourceError
from livebode.sources.live import SourceSettings, make_source
from livebode_drives.live.can_bus import FOREIGN_FRAMES
from livebode_drives.live.can_samples import SETTLED, CanSamples, FrameClock, signals_of
from livebode_drives.recordings.dbc import messages_of
from tests.support.errors import refused
from tests.support.peers.can_bus import CanPeer
from tests.support.peers.peer import PATIENCE_S, STAMP_S, fed, until

DBCS = Path(__file__).parents[3] / "examples/can"
ODRIVE, MOTEUS = DBCS / "odrive.dbc", DBCS / "moteus.dbc"
ENCODER, TORQUE, IQ = 0x29, 0x2E, 0x34
RATE_HZ = 1000.0
CHANNELS = ["Set_Input_Torque.Input_Torque", "Iq_Setpoint", "Vel_Estimate [rev/s]"]


def odrive(channels: list[str] = CHANNELS, counter: str | None = None) -> CanSamples:
    messages = messages_of(ODRIVE, ODRIVE)
    return CanSamples(signals_of(channels, messages, ODRIVE), messages, RATE_HZ, counter, 0)


def frames(number: int) -> list[tuple[int, float, bytes]]:
    """What the bus carries in one period: the command, then both answers; identifier, delay and content."""
    f = float(number)
    return [
        (TORQUE, 0.0, struct.pack("<f", f)),
        (IQ, 2e-4, struct.pack("<ff", f, -f)),
        (ENCODER, 3e-4, struct.pack("<ff", f / 2, f)),
    ]


@settings(max_examples=40)
@given(
    seed=st.integers(0, 1000), ppm=st.sampled_from([-2000, -50, 0, 100, 2000]), jitter=st.sampled_from([0.0, 0.1, 0.2]),
    begin=st.integers(0, 2), lost=st.sets(st.integers(300, 1100), max_size=60),
)  # fmt: skip
def test_samples_are_put_together_by_the_times_of_frames(seed, ppm, jitter, begin, lost):
    """The drive's clock differs from this computer's, frames wait for the bus, and some are lost."""
    rng = np.random.default_rng(seed)
    samples, found = odrive(), []
    order = [(n, *frame) for n in range(400) for frame in frames(n)][begin:]
    for place, (number, identity, delay, data) in enumerate(order):
        if place not in lost:
            time_s = STAMP_S + number / RATE_HZ * (1 + ppm * 1e-6) + delay + jitter / RATE_HZ * rng.random()
            found += samples.process((identity, False), data, time_s)
    assert samples.problems == []
    rows = np.array([sample.row for sample in found])
    assert (rows == rows[:, :1]).all()  # of one period
    numbers = np.array([sample.number for sample in found])
    np.testing.assert_array_equal(numbers - numbers[0], rows[:, 0] - rows[0, 0])
    whole = {number for number, *_ in order} - {order[place][0] for place in lost}
    assert set(rows[:, 0]) == {n for n in whole if n >= rows[0, 0]}
    assert rows[0, 0] <= SETTLED + 2


def test_a_frame_whose_number_is_not_certain_is_not_a_sample():
    clock = FrameClock(1000.0)
    assert [clock.add(t) for t in (0.0, 0.00105, 0.0024, 0.00245, 0.0041)] == [True, True, True, False, True]
    assert clock.number == 4
    samples = odrive(["Vel_Estimate"])
    for n in range(200):
        samples.process((ENCODER, False), bytes(8), n / 1000)
    assert samples.problems == []
    later = [s for n in range(60) for s in samples.process((ENCODER, False), bytes(8), 0.20047 + n / 1000)]
    assert "more than 0.4 periods" in samples.problems[0]
    assert {sample.epoch for sample in later} == {1}  # numbering begins again rather than never
    gone = [s for n in range(60) for s in samples.process((ENCODER, False), bytes(8), 9 + n / 1000)]
    assert {sample.epoch for sample in gone} == {2}


def test_a_bus_that_is_set_to_half_its_rate_is_reported():
    samples = odrive(["Vel_Estimate"])
    for n in range(100):
        samples.process((ENCODER, False), bytes(8), n / 2000)
    assert "check source.rate_hz" in samples.problems[0]


class OdrivePeer(CanPeer):
    def __enter__(self) -> OdrivePeer:
        super().__enter__()
        self.settings = {
            "url": f"can:virtual/{self.channel}", "dbc": ODRIVE, "rate_hz": RATE_HZ, "channels": CHANNELS,
        }  # fmt: skip
        return self

    def period(self, number: int) -> None:
        for identity, delay, data in frames(number):
            self.frame(identity, data, STAMP_S + number / RATE_HZ + delay)


def test_an_odrive_on_a_bus_with_errors_is_followed(tmp_path):
    """Error frames, a frame that is too short, and bus-off: each is reported, and the stream is true."""
    with OdrivePeer(tmp_path) as peer:

        def script():
            peer.wait_ready()
            for number in range(100):
                peer.period(number)
            peer.frame(0x28, b"", 0.0, is_error_frame=True)
            peer.frame(TORQUE, b"\0\0", STAMP_S + 0.1)
            for number in range(101, 200):
                peer.period(number)
            receivers = list(peer._bus.channel)
            peer.frame(0x40, b"", 0.0, is_error_frame=True)
            until(lambda: not all(one in peer._bus.channel for one in receivers), "the bus to be closed")
            peer.wait_ready()
            for number in range(500, 600):
                peer.period(number)

        with fed(peer, script) as source:
            assert [channel.name for channel in source.channels] == [CHANNELS[0], "Iq_Setpoint", "Vel_Estimate"]
            assert [channel.source_unit for channel in source.channels] == ["N m", "A", "rev/s"]
            factors = np.array([[channel.factor] for channel in source.channels])
            blocks = []
            for block in source.blocks():
                blocks.append(block)
                if block.data[0, -1] == 599:
                    break
            events = source.take_events()
    for block in blocks:
        np.testing.assert_allclose(block.data / factors, np.tile(block.data[:1], (3, 1)), rtol=1e-15)
        np.testing.assert_array_equal(np.diff(block.data[0]), 1)
    for a, b in pairwise(blocks):
        assert b.gap == (b.data[0, 0] != a.data[0, -1] + 1)
    kinds = [event.kind for event in events]
    assert kinds.count("restart") == 1
    assert (kinds.count("connected"), kinds.count("disconnected"), kinds.count("malformed")) == (2, 1, 2)
    text = " ".join(event.message for event in events)
    for words in ("protocol violation, no acknowledge", "has 2 bytes, the DBC defines 4", "bus-off"):
        assert words in text
    assert next(event.details["missing_samples"] for event in events if event.kind == "loss") == 1


def test_a_moteus_answer_of_can_fd_is_decoded():
    messages = messages_of(MOTEUS, MOTEUS)
    samples = CanSamples(signals_of(["Torque", "moteus.Velocity"], messages, MOTEUS), messages, RATE_HZ, None, 0)
    found = []
    for n in range(100):
        data = b"\x2f\x01" + struct.pack("<fff", 0.25, n, -n) + b"\x50\x50"  # padded to a length of CAN FD
        found += samples.process((0x100, False), data, n / RATE_HZ)
    np.testing.assert_array_equal([sample.row for sample in found], [(-n, n) for n in range(SETTLED, 100)])


def test_a_dbc_of_another_node_is_reported_with_what_the_bus_has(tmp_path):
    with OdrivePeer(tmp_path) as peer:
        source = make_source(SourceSettings(**peer.settings, timeout_s=PATIENCE_S))

        def told() -> bool:
            return source.health.counts["malformed"] > 0

        source._thread.start()
        peer.wait_ready()
        for number in range(FOREIGN_FRAMES // 2 + 1):
            for identity in (0x49, 0x54):  # node 2
                peer.frame(identity, bytes(8), STAMP_S + number / RATE_HZ)
        until(told, "a report")
        source.close()
        message = next(event.message for event in source.take_events() if event.kind == "malformed")
    assert "Set_Input_Torque (0x2E), Get_Iq (0x34), Get_Encoder_Estimates (0x29)" in message
    assert "0x49, 0x54" in message


@pytest.mark.parametrize(
    ("given_keys", "code", "facts"),
    [
        ({"dbc": None}, "key-missing", {"keys": ["dbc"]}),
        ({"rate_hz": None}, "key-missing", {"keys": ["rate_hz"]}),
        ({"channels": []}, "key-missing", {"keys": ["channels"]}),
        ({"channels": ["Vel_Estimat"]}, "value-invalid", {"channel": "Vel_Estimat"}),
        ({"counter": "n"}, "value-invalid", {"key": "source.counter", "value": "n"}),
        ({"counter": "Iq_Setpoint"}, "value-invalid", {"value": "Iq_Setpoint"}),
        ({"channels": ["Vel_Estimate"], "counter": "Vel_Estimate"}, "value-invalid", {"value": "Vel_Estimate"}),
    ],
)
def test_impossible_settings_of_a_bus_are_refused(given_keys, code, facts):
    keys = {"url": "can:virtual/1", "dbc": ODRIVE, "rate_hz": 1000.0, "channels": CHANNELS} | given_keys
    with refused(ConfigError, code, **facts):
        make_source(SourceSettings(**{key: value for key, value in keys.items() if value is not None}))


def test_an_interface_that_is_not_there_is_refused_at_once():
    keys = {"url": "can:nothing/1", "dbc": ODRIVE, "rate_hz": 1000.0, "channels": CHANNELS}
    with refused(SourceError, "refused", interface="nothing"):
        make_source(SourceSettings(**keys)).open()
