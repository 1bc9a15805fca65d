"""The axis in motion, its responses with the motion corrected, and their errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from livebode.core import Block, Responses
from livebode.estimation import Settings
from livebode.fitting.two_masses import fit_windows
from livebode.motion import MotionCorrection
from livebode.simulation import BeltAxis, Sensor, Strokes
from tests.support.axes import LINES, MULTISINE, RATE_HZ

SETTINGS = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x")


def axis(sigma: float, strokes: int = 1, seed: int = 0, motion: Strokes | None = None) -> BeltAxis:
    """Forward and return strokes, whole dwells included."""
    motion = motion or Strokes()
    seconds = (motion.cycle(RATE_HZ)[0].size // 2 * strokes + LINES.window) / RATE_HZ
    sensor = Sensor(noise_rad_per_s=sigma)
    return BeltAxis(motion=motion, excitation_n_m=MULTISINE, sensor=sensor, seconds=seconds, seed=seed)


def corrected(run: BeltAxis, block: Block, settings: Settings = SETTINGS, **options: Any) -> Responses:
    """The run through a MotionCorrection with a stroke a chunk."""
    radius_m, chunk = run.mechanics.radius_m, run.motion.cycle(RATE_HZ)[0].size // 2
    correction = MotionCorrection(settings, radius_m=radius_m, chunk_samples=chunk, **options)
    return Responses.join([correction.process(block), correction.finish()])


def truth_at(run: BeltAxis, position_m: np.ndarray) -> np.ndarray:
    """Response of the local linearisation at each position, shape (positions, lines)."""
    return np.array([run.linear(float(x)).sampled(RATE_HZ).response(LINES.frequency_hz) for x in position_m])


def cruising(run: BeltAxis, sample: np.ndarray, after_s: float = 0.1) -> np.ndarray:
    """Rows whose window, and `after_s` before it, lie in a motion at constant speed."""
    speed = run.motion.cycle(RATE_HZ)[1]
    n = np.arange(int(sample.max()) + 1) % speed.size
    changes = np.cumsum((speed[n] != speed[n - 1]) | (speed[n] == 0))
    first = np.maximum(sample - LINES.window + 1 - round(after_s * RATE_HZ), 0)
    return changes[sample] == changes[first]


@dataclass(frozen=True)
class Rms:
    """Errors of the windows at constant speed: |G| in dB over windows and lines, Keff and Js in percent."""

    db: float
    keff: float
    js: float


def errors(run: BeltAxis, responses: Responses, after_s: float = 0.1) -> Rms:
    rows = np.flatnonzero(responses.valid.all(axis=1) & cruising(run, responses.sample, after_s))
    value, at = responses.value[rows], responses.schedule[rows]
    truth, m = truth_at(run, at), run.mechanics
    # White noise on y makes the error of a response n/|U|; U/W = 1/(1 + F·G).
    weight = 1 / np.abs(1 + run.drive.loop().feedback_at(LINES.frequency_hz) * truth)
    masses = np.ones((at.size, 2)) * [m.inertia_kg_m2, m.load_kg * m.radius_m**2]
    belt = np.column_stack([m.stiffness_at(at), m.damping_at(at)]) * m.radius_m**2
    found, _ = fit_windows(value, weight, LINES.z, RATE_HZ, np.log(1.05 * np.hstack([masses, belt])))
    keff, js = np.exp(found[:, 2]) / belt[:, 0] - 1, np.exp(found[:, 0]) / m.inertia_kg_m2 - 1
    return Rms(_rms(20 * np.log10(np.abs(value / truth))), 100 * _rms(keff), 100 * _rms(js))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
