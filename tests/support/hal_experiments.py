"""An experiment.toml for the closed loop in tests/support/peers/hal.py, whose plant a run has measured before."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from livebode.configuration import Axis
from livebode.runtime import Destination, run
from tests.support.command import write_csv
from tests.support.peers.hal import GAIN, INTEGRAL, RATE_HZ, plant, sensitivity

WINDOW = 400
BINS = np.arange(2, 31, 2)
AXIS = f"""
[source]
log = "known.csv"
[signals]
excitation = "w"
input = "u"
output = "velocity"
[lines]
frequencies = "20:300:20"
window = {WINDOW}
[loop.velocity]
gain = {GAIN}
integral_time_s = {GAIN / INTEGRAL}
rate_hz = {RATE_HZ}
"""
EXPERIMENT = """
[measured]
run = "known"
noise = 0.005

[limits]
torque_n_m_max = 3.0

[excitation]
lines = "20:140:20"
window = 400
{excitation}

[source]
url = "hal:sampler.0"
sample_signal = "n"
channels = ["w [N m]", "u [N m]", "velocity [rad/s]"]

[measure]
ramp_down_s = 0.25
{measure}
"""


def known_machine(folder: Path) -> None:
    """The run `known`: the periodic state of the loop, computed in closed form."""
    n = np.arange(20 * WINDOW)
    turns = 2 * np.pi * np.outer(BINS, n) / WINDOW + (BINS**2)[:, np.newaxis]
    frequency_hz = BINS * RATE_HZ / WINDOW
    through = {"w": np.ones(BINS.size), "u": sensitivity(frequency_hz)}
    through["velocity"] = through["u"] * plant(frequency_hz)
    noise = np.random.default_rng(3).normal(0, 1e-4, (3, n.size))
    columns = {name: np.real(h @ np.exp(1j * turns)) + noise[i] for i, (name, h) in enumerate(through.items())}
    titles = {"w": "w [N m]", "u": "u [N m]", "velocity": "velocity [rad/s]"}
    write_csv(folder / "known.csv", {"t [s]": n / RATE_HZ} | {titles[name]: x for name, x in columns.items()})
    (folder / "known.toml").write_text(AXIS)
    run(Axis.read(folder / "known.toml"), Destination(folder / "known", lambda *_: None))


def write_experiment(folder: Path, excitation: str = "accuracy = 0.03", measure: str = "") -> Path:
    """experiment.toml beside the run."""
    path = folder / "experiment.toml"
    path.write_text(EXPERIMENT.format(excitation=excitation, measure=measure))
    return path
