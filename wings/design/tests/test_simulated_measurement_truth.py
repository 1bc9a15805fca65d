"""`livebode measure --simulated`: from an experiment to a response within its bounds, without a machine."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest

import livebode
from livebode.simulation import BeltAxis, Friction, Sensor, Standstill
from livebode.sources import open_log
from tests.support.command import livebode as command
from tests.support.forked import Command
from tests.support.peers.peer import PATIENCE_S, until

EXPERIMENT = """
[belt.standstill]
position_m = 0.8
[belt.sensor]
noise_rad_per_s = 0.05
[belt.friction]
load_coulomb_n = 0.0
motor_coulomb_n_m = 0.0
[excitation]
band_hz = [20, 140]
resolution_hz = 20
accuracy = 0.02
"""


@pytest.fixture
def experiment(tmp_path: Path) -> Path:
    path = tmp_path / "experiment.toml"
    path.write_text(EXPERIMENT)
    return path


def test_a_simulated_controller_gives_the_response_of_its_axis(experiment: Path, tmp_path: Path) -> None:
    """Of seven lines none is farther from the truth than its bound of 99.99 %."""
    done = command("measure", experiment, "--simulated", "--out", tmp_path / "out")
    assert done.code == 0, done.err
    assert "complete; ramping down" in done.out
    average = livebode.Run(tmp_path / "out" / "run").average
    axis = BeltAxis(motion=Standstill(position_m=0.8), sensor=Sensor(noise_rad_per_s=0.05), friction=Friction())
    truth = axis.linear(0.8).sampled(average.lines.rate_hz).response(average.frequency_hz)
    assert np.all(np.abs(average.value - truth) <= average.bound(np.log(1e4) ** 0.5))


def test_ctrl_c_ramps_down_on_a_simulated_controller_too(experiment: Path, tmp_path: Path) -> None:
    """The last twentieth of a second of the ramp of half a second has a tenth of the peak; then it is zero."""
    log = tmp_path / "out" / "log.csv"
    with Command("measure", experiment, "--simulated", "--out", tmp_path / "out") as process:
        until(lambda: log.exists() and len(log.read_bytes().splitlines()) > 2500, "the excitation to be played")
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 128 + signal.SIGINT
    w = next(iter(open_log(log).blocks(["w"])))["w"]
    played = np.flatnonzero(w)
    assert played[-1] < w.size - 150
    assert 0 < np.abs(w[played[-200:]]).max() <= 0.101 * np.abs(w).max()
    assert not (tmp_path / "out" / "run").exists()


def test_a_measured_machine_cannot_be_simulated(tmp_path: Path) -> None:
    path = tmp_path / "experiment.toml"
    path.write_text('[measured]\nrun = "run"\n[excitation]\nband_hz = [20, 140]\nresolution_hz = 20\n')
    refused = command("measure", path, "--simulated", "--out", tmp_path / "out")
    assert refused.code == 2
    assert "the experiment has no [belt]" in refused.err
