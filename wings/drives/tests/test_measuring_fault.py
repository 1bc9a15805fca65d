"""Whatever ends a measurement, the excitation ends at zero, and what was recorded remains."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from livebode.core import ConfigError, MeasurementError
from livebode.sources.live import SourceSettings
from livebode_design import Experiment, prepare
from livebode_design.measurement import make_player
from tests.support.command import livebode
from tests.support.errors import refused
from tests.support.forked import Command
from tests.support.hal_experiments import known_machine, write_experiment
from tests.support.peers.hal import RATE_HZ, Hal, only_hal
from tests.support.peers.peer import PATIENCE_S, until

LONG = "accuracy = 0.0001\namplitude_n_m = 0.2"
"""A recording of more than a minute."""


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("known")
    known_machine(folder)
    return folder


@pytest.fixture
def hal() -> Iterator[Hal]:
    with only_hal(), Hal() as found:
        yield found


def excitation(hal: Hal) -> float:
    return float(hal.halcmd("getp", "mux2.0.out"))


def measuring(hal: Hal, file: Path, out: Path) -> Command:
    """The process, when the excitation has been steady for some periods."""
    process = Command("measure", file, "--out", out)
    until(lambda: process.poll() is not None or excitation(hal) != 0.0, "the excitation")
    began = hal.periods()
    until(lambda: process.poll() is not None or hal.periods() > began + 3 * RATE_HZ // 4, "its ramp")
    assert process.poll() is None, process.printed
    return process


def has_ended(hal: Hal) -> None:
    until(lambda: hal.halcmd("getp", "streamer.0.empty").strip() == "TRUE", "the end of the excitation")
    assert excitation(hal) == 0.0


def played(out: Path) -> NDArray[np.float64]:
    return np.loadtxt(out / "log.csv", delimiter=",", skiprows=1, usecols=1)


def ramp(w: NDArray[np.float64], out: Path) -> int:
    """Number of samples from the last one with the design's amplitude to the last one that is not zero."""
    peak = json.loads((out / "design.json").read_text())["peak_n_m"]
    return int(np.flatnonzero(w)[-1] - np.flatnonzero(np.abs(w) > 0.99 * peak)[-1])


def test_a_signal_ramps_down_and_the_record_remains(hal: Hal, known: Path, tmp_path: Path) -> None:
    file = write_experiment(known, LONG, "lead_s = 1.0")
    with measuring(hal, file, tmp_path / "out") as process:
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 130
        assert b"stopping: the excitation is zero in 1.55 s" in process.printed
    has_ended(hal)
    w = played(tmp_path / "out")
    assert w[-1] == 0.0
    assert 0.25 * RATE_HZ * 0.8 < ramp(w, tmp_path / "out") < 0.25 * RATE_HZ + 400
    assert not (tmp_path / "out" / "run").exists()


def test_a_second_signal_switches_it_off_and_the_machine_is_wired_as_before(
    hal: Hal, known: Path, tmp_path: Path
) -> None:
    file = write_experiment(known, LONG, "lead_s = 1.0")
    with measuring(hal, file, tmp_path / "out") as process:
        process.send_signal(signal.SIGTERM)
        until(lambda: b"stopping" in process.printed, "the first request")
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 128 + signal.SIGTERM
    has_ended(hal)
    assert ramp(played(tmp_path / "out"), tmp_path / "out") < 400
    prepare(Experiment.read(file))


def test_a_killed_process_leaves_no_excitation(hal: Hal, known: Path, tmp_path: Path) -> None:
    file = write_experiment(known, LONG)
    with measuring(hal, file, tmp_path / "out") as process:
        process.kill()
        process.wait(PATIENCE_S)
    has_ended(hal)
    assert played(tmp_path / "out").any()


def test_a_limit_ramps_down_and_is_named(hal: Hal, known: Path, tmp_path: Path) -> None:
    file = write_experiment(known, LONG, "limits = { velocity = 0.3 }")
    done = livebode("measure", file, "--out", tmp_path / "out")
    assert done.code == 2
    assert "velocity = " in done.err
    assert "is outside of its limits -0.3 … 0.3 rad/s" in done.err
    has_ended(hal)
    velocity = np.loadtxt(tmp_path / "out" / "log.csv", delimiter=",", skiprows=1, usecols=3)
    beyond = int(np.flatnonzero(np.abs(velocity) > 0.3)[0])
    w = played(tmp_path / "out")
    assert np.count_nonzero(w[beyond:]) < 0.95 * RATE_HZ + 400  # samples of HAL, whatever time they took here


def test_a_limit_that_is_exceeded_at_rest_plays_nothing(hal: Hal, known: Path, tmp_path: Path) -> None:
    file = write_experiment(known, LONG, "limits = { velocity = [0.5, 1.0] }")
    done = livebode("measure", file, "--out", tmp_path / "out")
    assert done.code == 2
    assert "is outside of its limits 0.5 … 1 rad/s" in done.err
    assert not played(tmp_path / "out").any()
    assert excitation(hal) == 0.0


def test_a_dead_real_time_part_ends_it(hal: Hal, known: Path, tmp_path: Path) -> None:
    file = write_experiment(known, LONG, "lead_s = 0.1\nsilence_s = 0.3")
    with measuring(hal, file, tmp_path / "out") as process:
        hal.kill()
        _, printed = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 2
        assert b"no samples arrived for" in printed
    assert played(tmp_path / "out").any()


def test_a_controller_that_could_stay_excited_is_refused(hal: Hal, known: Path) -> None:
    experiment = Experiment.read(write_experiment(known))
    hal.halcmd("setp", "mux2.0.in1", "0.1")
    with refused(MeasurementError, "not-connected", player="streamer.0"):
        prepare(experiment)
    hal.halcmd("setp", "mux2.0.in1", "0")
    prepare(experiment)
    hal.halcmd("unlinkp", "mux2.0.sel")
    with refused(MeasurementError, "not-connected"):
        prepare(experiment)
    hal.halcmd("net", "nothing-left", "mux2.0.sel")
    prepare(experiment)
    with pytest.raises(MeasurementError, match=r"no streamer\.2 is loaded"):
        prepare(Experiment.read(write_experiment(known, measure="streamer = 2")))
    hal.play(np.zeros(60 * RATE_HZ))
    with pytest.raises(MeasurementError, match=r"another program plays through streamer\.0"):
        prepare(experiment)


def test_what_cannot_be_measured_is_refused(known: Path) -> None:
    experiment = Experiment.read(write_experiment(known))
    with refused(ConfigError, "key-missing", key="source"):
        prepare(experiment.model_copy(update={"source": None}))
    with refused(MeasurementError, "not-playable", allowed=["ads", "hal"]):
        make_player(SourceSettings(url="udp://127.0.0.1:5000"), experiment.measure, "w")
    with refused(ConfigError, "key-missing", key="source"):
        make_player(SourceSettings(log="a.csv"), experiment.measure, "w")
