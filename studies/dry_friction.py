"""Windows that the correction of motion marks as not valid: at standstill under dry friction, and without friction."""

from __future__ import annotations

import numpy as np

from livebode import Block, Event, Responses, Settings, Tracker, multisine
from livebode.motion import MotionCorrection
from livebode.simulation import BeltAxis, Friction, Sensor, SimulatedAxis, Strokes
from studies.common import RATE_HZ, SIGMA, WINDOW, Local, decibels, lines

SETTINGS = Settings(lines=lines(), output="velocity", input="u", excitation="w", schedule="x")


def dwelling(amplitude: float, friction_n: float) -> tuple[float, float, float, float, int, float]:
    """Two strokes with dwells of 1 s: amplitude, friction, errors while the cart stands, events, and % invalid.

    The errors are of |G| at the worst line in dB, of 95 % of windows: before the correction, and after it where valid.
    """
    motion = Strokes(dwell_s=1.0)
    block, ours, events = _corrected(amplitude, motion, Friction(load_coulomb_n=friction_n))
    raw = Tracker(SETTINGS).process(block)
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(block["velocity_reference"]))])
    rows = np.flatnonzero(raw.valid.all(axis=1) & (travelled[raw.sample + 1] == travelled[raw.first]))
    truth = Local()(ours.schedule[rows])
    before, after = (np.abs(decibels(value[rows] / truth)).max(axis=1) for value in (raw.value, ours.value))
    after = after[np.isfinite(after)]
    left = float(np.quantile(after, 0.95)) if after.size else 0.0
    invalid = 100 * float(np.mean(~ours.valid[rows].all(axis=1)))
    return amplitude, friction_n, float(np.quantile(before, 0.95)), left, events, invalid


def smooth(amplitude: float, speed_m_per_s: float) -> tuple[float, int, float]:
    """Four strokes without dry friction: speed, held events, and % of the windows that are invalid after the first."""
    _, ours, events = _corrected(amplitude, Strokes(speed_m_per_s=speed_m_per_s, dwell_s=0.3), Friction(), strokes=4)
    whole = ours.first >= 0
    return speed_m_per_s, events, 100 * float(np.mean(~ours.valid[whole].all(axis=1)))


def _corrected(amplitude: float, motion: Strokes, friction: Friction, strokes: int = 2) -> tuple[Block, Responses, int]:
    stroke = motion.cycle(RATE_HZ)[0].size // 2
    axis = BeltAxis(
        motion=motion,
        excitation_n_m=amplitude * multisine(lines()),
        friction=friction,
        sensor=Sensor(noise_rad_per_s=SIGMA),
        seconds=(stroke * strokes + WINDOW) / RATE_HZ,
    )
    block, _ = SimulatedAxis(axis).run()
    correction = MotionCorrection(SETTINGS, radius_m=axis.mechanics.radius_m, chunk_samples=stroke)
    events: list[Event] = []
    ours = Responses.join([correction.process(block, events.append), correction.finish(events.append)])
    return block, ours, sum(event.kind == "held" for event in events)
