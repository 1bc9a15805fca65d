"""Samples of openDAQ's reference device, in this process and over its native protocol."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from livebode.core import Channel, SourceError
from livebode.sources.live import LiveSource, SourceSettings, make_source, open_source
from livebode_drives.live import daq as daq_module
from livebode_drives.live.daq import BEHIND_MAX, TogetherByNumber, chosen_signals
from tests.support.errors import refused
from tests.support.peers.peer import PATIENCE_S, free_port, until

pytestmark = pytest.mark.skipif(sys.version_info >= (3, 13), reason="openDAQ has no package for this Python")
SERVER = Path(__file__).parents[3] / "tests/support/peers/daq_server.py"
RATE_HZ, AMPLITUDE, SINE_HZ = 1000.0, 5.0, 10.0
"""The defaults of the reference device."""


@contextmanager
def serving(port: int) -> Iterator[None]:
    with subprocess.Popen(
        [sys.executable, str(SERVER), str(port)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        assert server.stdout.readline() == "serving\n"
        yield
        server.kill()


def collected(source: LiveSource, samples: int) -> np.ndarray:
    timer = threading.Timer(PATIENCE_S, source.stop)
    timer.start()
    blocks = []
    for block in source.blocks():
        blocks.append(block.data)
        if sum(data.shape[1] for data in blocks) >= samples:
            break
    timer.cancel()
    return np.concatenate(blocks, axis=1)[:, :samples]


def is_sine(values: np.ndarray) -> None:
    """A sine of the device's amplitude and frequency, at the times that the numbers of its samples say."""
    base = np.exp(2j * np.pi * SINE_HZ * np.arange(values.size) / RATE_HZ)
    columns = np.stack([base.real, base.imag], axis=1)
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    assert np.hypot(*found) == pytest.approx(AMPLITUDE, rel=1e-6)
    assert np.max(np.abs(columns @ found - values)) < 1e-6


def test_the_reference_device_is_read_without_a_loss():
    with open_source(SourceSettings(url="daqref://device0", timeout_s=PATIENCE_S)) as source:
        assert source.channels == (Channel("AI0", "V"), Channel("AI1", "V"))
        assert source.rate_hz == RATE_HZ
        data = collected(source, 500)
        assert source.health.lost == 0
        assert [event.kind for event in source.take_events()] == ["connected"]
    for values in data:
        is_sine(values)


def test_a_device_in_the_network_that_goes_is_connected_again(monkeypatch):
    monkeypatch.setattr(daq_module, "SILENCE_S", 0.5)
    port = free_port()
    settings = SourceSettings(url=f"daq.nd://127.0.0.1:{port}", timeout_s=PATIENCE_S, channels=["AI1 [A]"])
    with make_source(settings) as source:
        with serving(port):
            source.open()
            assert source.channels == (Channel("AI1", "A"),)
            is_sine(collected(source, 300)[0])
        until(lambda: source.health.counts["disconnected"], "the silence to be noticed")
        with serving(port):
            until(lambda: source.health.counts["connected"] == 2, "another connection")
            assert collected(source, 300).shape == (1, 300)
        counts = source.health.counts
    assert counts["loss"] == 1  # of a length that the ticks of the device tell
    assert counts["restart"] == 0


def test_samples_of_several_signals_are_put_together_by_number():
    together = TogetherByNumber(2)
    together.add(0, np.arange(10, 20), np.arange(10.0, 20.0))
    assert together.pop() == []
    together.add(1, np.array([12, 13, 15, 16, 17]), -np.array([12.0, 13, 15, 16, 17]))
    runs = together.pop()
    assert [first for first, _ in runs] == [12, 15]
    for first, data in runs:
        np.testing.assert_array_equal(data[0], first + np.arange(data.shape[1]))
        np.testing.assert_array_equal(data[1], -data[0])
    together.add(1, np.array([18]), np.array([-18.0]))
    assert together.pop()[0][0] == 18
    together.add(0, np.arange(100, 101 + BEHIND_MAX), np.zeros(1 + BEHIND_MAX))
    assert together.dropped == 2
    assert together.pop() == []


def signal(delta: int) -> SimpleNamespace:
    rule = SimpleNamespace(parameters={"delta": delta, "start": 0})
    ratio = SimpleNamespace(numerator=1, denominator=1000)
    domain = SimpleNamespace(descriptor=SimpleNamespace(rule=rule, tick_resolution=ratio))
    return SimpleNamespace(domain_signal=domain, descriptor=SimpleNamespace(unit=None))


def test_only_signals_of_one_clock_are_put_together():
    found = {"a": signal(1), "b": signal(1), "c": signal(2)}
    assert [channel.name for channel, _ in chosen_signals(found, [])] == ["a", "b"]
    for headings, words in ((["a", "c"], "another clock"), (["d"], "no sampled signal 'd'")):
        with refused(SourceError, "refused"):
            chosen_signals(found, headings)
        with pytest.raises(SourceError, match=words):
            chosen_signals(found, headings)
    with pytest.raises(SourceError, match="no signal that is sampled"):
        chosen_signals({}, [])
