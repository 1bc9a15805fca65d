"""Sensitivity of the extended Kalman filter to its start: the number of runs in which it diverges."""

from __future__ import annotations

import numpy as np

from livebode import Block, multisine
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis
from studies.peers import kalman
from studies.peers.recording import LINES, NOISE_RAD_PER_S, RATE_HZ, STROKES

SEEDS, SECONDS = range(60), 0.3
WIDE = kalman.DOUBT * np.array([10, 10, 10, 1, 1, 2, 2, 1, 1])
FACTOR_MAX = 20.0  # a parameter further than this from its nominal value is lost


def beginning(seed: int) -> Block:
    axis = BeltAxis(
        motion=STROKES,
        excitation_n_m=multisine(LINES),
        seconds=SECONDS,
        sensor=Sensor(noise_rad_per_s=NOISE_RAD_PER_S),
        seed=seed,
    )
    return SimulatedAxis(axis).run()[0]


def diverges(block: Block, doubt: np.ndarray) -> bool:
    inputs = kalman.START, doubt, kalman.WANDER, NOISE_RAD_PER_S, 1 / RATE_HZ, kalman.NONE
    with np.errstate(all="ignore"):
        logs = kalman.filtered(block["u"], block["velocity"], *inputs)[:, 3:7]
    return not bool(np.all(np.abs(logs - kalman.START[3:7]) < np.log(FACTOR_MAX)))


def sentence() -> str:
    blocks = [beginning(seed) for seed in SEEDS]
    narrow, wide = (sum(diverges(block, doubt) for block in blocks) for doubt in (kalman.DOUBT, WIDE))
    return (
        f"Of {len(SEEDS)} starts of the EKF, {narrow} diverge; with ten times the initial uncertainty of torsion and "
        f"speeds and twice that of the masses, {wide} diverge."
    )
