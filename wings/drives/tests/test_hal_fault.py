"""What a person reads when LinuxCNC's HAL is not there, ends, is wired otherwise or is read by two programs."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from livebode.core import ConfigError, SourceError
from livebode.sources.live import SourceSettings, make_source, open_source
from livebode_drives.live.hal import SampleText, begun_by_two, consecutive
from livebode_drives.live.hal_wiring import SAMPLER_KEY, fifo, halcmd
from tests.support.command import livebode
from tests.support.errors import refused
from tests.support.peers.hal import SETTINGS, Hal, only_hal, remove_memory
from tests.support.peers.peer import until


@pytest.fixture
def hal() -> Iterator[Hal]:
    with only_hal(), Hal() as found:
        yield found


def told(**more: object) -> str:
    with pytest.raises(SourceError) as caught:
        open_source(SourceSettings(**(SETTINGS | {"timeout_s": 0.3} | more)))
    return str(caught.value)


@pytest.mark.usefixtures("hal")
def test_the_doctor_finds_the_signals_and_the_rate(tmp_path: Path) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(
        '[source]\nurl = "hal:sampler.0"\nsample_signal = "n"\n[signals]\nexcitation = "w"\ninput = "u"\n'
        'output = "velocity"\n[lines]\nfrequencies = "20"\nwindow = 400\n'
    )
    assert "samples w, u, velocity at 4000 Hz" in " ".join(livebode("doctor", path).out.split())
    path.write_text(path.read_text().replace("sampler.0", "sampler.1"))
    assert "no sampler.1 is loaded" in " ".join(livebode("doctor", path).out.split())


def test_a_machine_that_is_wired_otherwise_is_named(hal: Hal) -> None:
    assert "has no signal 'w1' at its pins; it has w, u, velocity, n" in told(channels=["w1"])
    assert "did you mean 'velocity'?" in told(channels=["velocty"])
    assert "has no signal 'count'" in told(sample_signal="count")
    assert "no sampler.1 is loaded" in told(url="hal:sampler.1")
    assert "does not count" in told(sample_signal="w", channels=["u"])
    with subprocess.Popen(["halsampler"], stdout=subprocess.DEVNULL) as other:
        until(lambda: (found := fifo(SAMPLER_KEY)) and found.users == 2, "the other halsampler at the FIFO")
        assert "end the other halsampler" in told()
        other.kill()
    hal.halcmd("setp", "sampler.0.enable", "0")
    # What was in the FIFO is older than the record.
    hal.halcmd("stop")
    assert "takes no samples: halcmd start" in told(timeout_s=1.5)


def test_a_killed_real_time_part_is_reported_and_a_new_one_is_a_restart(hal: Hal) -> None:
    with open_source(SourceSettings(**SETTINGS)) as source:
        stream, events = source.stream(), []

        def seen(kind: str) -> bool:
            next(stream)
            events.extend(source.take_events())
            return any(event.kind == kind for event in events)

        hal.kill()
        until(lambda: seen("disconnected"), "the end")
        assert "the real-time part of LinuxCNC has ended" in events[-1].message
        assert "no sampler.0 is loaded: start LinuxCNC" in told()
        remove_memory()
        hal.start()
        until(lambda: seen("restart"), "a restart")
    assert [event.kind for event in events] == ["connected", "disconnected", "connected", "restart"]


def test_settings_that_cannot_work_are_refused() -> None:
    with refused(ConfigError, "key-missing", keys=["sample_signal"]):
        make_source(SourceSettings(url="hal:sampler.0"))
    for url in ("hal:", "hal:streamer.0", "hal:sampler.9", "hal:sampler.0/x"):
        with refused(ConfigError, "value-invalid", key="source.url"):
            make_source(SourceSettings(url=url, sample_signal="n"))
    with refused(ConfigError, "key-unused", key="source.rate_hz"):
        make_source(SourceSettings(url="hal:sampler.0", sample_signal="n", rate_hz=1000.0))


def test_a_computer_without_linuxcnc_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with only_hal():
        assert "no sampler.0 is loaded" in told()
    monkeypatch.setenv("PATH", str(tmp_path))
    with refused(SourceError, "refused", program="halcmd"):
        halcmd("show", "pin")


@pytest.mark.parametrize("cut", [1, 2, 3])
def test_a_signal_that_does_not_count_is_refused_however_its_samples_come(cut: int) -> None:
    constant = np.zeros((2, 5))
    tables = [constant[:, first : first + cut] for first in range(0, 5, cut)]
    first, *others = begun_by_two(iter(tables))
    assert np.array_equal(np.concatenate([first, *others], axis=1), constant)
    with refused(SourceError, "value-invalid", key="source.sample_signal"):
        consecutive(first, 0)


@pytest.mark.parametrize("cut", [1, 3, 7, 1000])
def test_text_of_halsampler_is_read_the_same_however_it_is_cut(cut: int) -> None:
    given = np.random.default_rng(cut).normal(size=(40, 3)).round(6)
    raw = b"overrun\n" + "".join(f"{a:.6f} {b:.6f} {c:.6f} \n" for a, b, c in given).encode()
    text = SampleText(3, stale=5)
    found = np.concatenate([text.table(raw[a : a + cut]) for a in range(0, len(raw), cut)], axis=1)
    np.testing.assert_array_equal(found, given[5:].T)


@pytest.mark.parametrize("line", [b"1 2\n", b"1 2 x\n", b"1 2 3 4\n", b"\xff 1 2\n"])
def test_a_line_that_is_no_sample_is_refused(line: bytes) -> None:
    with refused(SourceError, "batch-shape", channels=3):
        SampleText(3).table(line)


@pytest.mark.parametrize("numbers", [[0.5, 1.5], [3.0, 3.0], [-1.0, 0.0], [np.nan, 1.0], [1e300, 1e300]])
def test_a_signal_that_does_not_count_is_refused(numbers: list[float]) -> None:
    with refused(SourceError, "value-invalid", key="source.sample_signal"):
        consecutive(np.array([numbers]), 0)
