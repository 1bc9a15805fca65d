"""What the studies share: the stroke, its truth and the errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from livebode import Block, Lines, Responses, Settings, Tracker, multisine
from livebode.motion import MotionCorrection
from livebode.simulation import BeltAxis, Mechanics, Sensor, SimulatedAxis, Strokes

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

RATE_HZ = 4000.0
WINDOW = 400  # 100 ms: the paper's N = 100 at 1 ms
SIGMA = 0.1  # rad/s on the velocity, as in the paper
STROKE = Strokes(start_m=0.25, end_m=1.6, speed_m_per_s=0.38, dwell_s=0.5)
RUN_IN_S = 10.0  # the loop is then in its periodic state to 1e-8


def lines(window: int = WINDOW, rate_hz: float = RATE_HZ) -> Lines:
    """20:20:140 Hz."""
    return Lines.parse("20:140:20", rate_hz=rate_hz, window=window)


# 1 N m a line. A period of 50 ms, so that it fits every window of a multiple of that.
EXCITATION = multisine(lines(200))


@dataclass(frozen=True)
class Recording:
    """One stroke: what was recorded, and the samples between which the reference moves."""

    axis: BeltAxis
    block: Block
    first: int
    last: int


def stroke(sigma: float = SIGMA, seed: int = 0, motion: Strokes = STROKE, **options: Any) -> Recording:
    """One stroke of the paper's simulation; `options` are those of the axis."""
    ticks = len(motion.cycle(RATE_HZ)[0]) // 2
    options = {"mechanics": Mechanics(), "excitation_n_m": EXCITATION, "run_in_s": RUN_IN_S} | options
    axis = BeltAxis(motion=motion, sensor=Sensor(noise_rad_per_s=sigma), seconds=ticks / RATE_HZ, seed=seed, **options)
    block, _ = SimulatedAxis(axis).run()
    moving = np.flatnonzero(block["velocity_reference"])
    return Recording(axis, block, int(moving[0]), int(moving[-1]))


def settings(rate_hz: float = RATE_HZ, window: int = WINDOW, **options: Any) -> Settings:
    """The joint estimate at 20:20:140 Hz, plotted over the cart's position."""
    signals = {"output": "velocity", "input": "u", "excitation": "w", "schedule": "x"}
    return Settings(**({"lines": lines(window, rate_hz)} | signals | options))


def track(block: Block, window: int = WINDOW, **options: Any) -> Responses:
    return Tracker(settings(block.rate_hz, window, **options)).process(block)


def correct(axis: BeltAxis, block: Block, chunk: int, settings: Settings, **options: Any) -> Responses:
    """The same with a MotionCorrection that fits `chunk` samples at a time."""
    correction = MotionCorrection(settings, radius_m=axis.mechanics.radius_m, chunk_samples=chunk, **options)
    return Responses.join([correction.process(block), correction.finish()])


def within_stroke(found: Responses, recording: Recording) -> Responses:
    """Those whose window lies wholly within the stroke, accelerating and braking included."""
    inside = np.flatnonzero((found.first >= recording.first) & (found.sample <= recording.last))
    return found[int(inside[0]) : int(inside[-1]) + 1]


class Local:
    """The local linearisation along the way: response from u to velocity as a function of the cart's position."""

    def __init__(self, mechanics: Mechanics | None = None, frequency_hz: Floats | None = None) -> None:
        axis = BeltAxis(mechanics=mechanics or Mechanics())
        at = lines().frequency_hz if frequency_hz is None else frequency_hz
        position_m = np.linspace(0.2, 1.65, 291)
        response = [axis.linear(float(x)).sampled(RATE_HZ).response(at) for x in position_m]
        self._spline = CubicSpline(position_m, np.array(response))

    def __call__(self, position_m: Floats) -> Complex:
        """Shape (positions, lines)."""
        return np.asarray(self._spline(position_m), dtype=np.complex128)


def error_db(found: Responses, truth: Complex) -> Floats:
    """Of |G|, shape (rows, lines)."""
    return decibels(found.value / truth)


def decibels(value: Complex | Floats) -> Floats:
    return np.asarray(20 * np.log10(np.abs(value)))


def rms(values: Floats, axis: int | None = None) -> Any:
    return np.sqrt(np.mean(np.square(values), axis=axis))
