"""Peaks predicted by a design, compared with the simulated axis, in the periodic state and after a start from rest.

python -m studies.design
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from livebode.core import Lines
from livebode.excitation import Waveform, chirp, chirp_lines, multisine, prbs
from livebode.simulation import (
    BeltAxis,
    Drive,
    Friction,
    Mechanics,
    Sensor,
    SimulatedAxis,
    Standstill,
    Strokes,
    extremes,
)
from livebode_design import belt_machine, peaks, worst

LINES = Lines.parse("20:140:20", 4000, 400)
FINE = Lines.parse("10:150:5", 4000, 1600)
ALONE = Lines.parse("40", 4000, 400)
NOISE = Sensor(noise_rad_per_s=0.1)
STANDSTILL = {
    "Schroeder": (BeltAxis(), LINES, multisine(LINES)),
    "with noise, low crest": (BeltAxis(sensor=NOISE), LINES, multisine(LINES, 1.0, "low crest")),
    "a line alone": (BeltAxis(), ALONE, multisine(ALONE)),
    "three masses, chirp": (
        BeltAxis(mechanics=Mechanics(masses=3)), chirp_lines(5, 250, 4000, 8000), chirp(5, 250, 4000, 8000, 2.0),
    ),
    "PRBS near the end": (
        BeltAxis(motion=Standstill(position_m=1.6)), Lines(tuple(range(6, 90)), 2555, 4000.0),
        prbs(9, 2.0, rate_divider=5),
    ),
    "late and stiff": (
        BeltAxis(drive=Drive(velocity_rate_hz=2000, position_rate_hz=1000, position_gain_per_s=10, delay_ticks=2)),
        FINE, multisine(FINE, 0.4, "random", seed=2),
    ),
    "differenced velocity": (
        BeltAxis(sensor=Sensor(velocity_differenced=True)), FINE, multisine(FINE, 0.4, "random", seed=3),
    ),
}  # fmt: skip
MOVING = {
    "the paper's strokes with friction and noise": (
        BeltAxis(motion=Strokes(), friction=Friction(load_coulomb_n=15.0), sensor=NOISE), LINES, multisine(LINES),
    ),
    "fast S-curves": (
        BeltAxis(motion=Strokes(speed_m_per_s=1.5, acceleration_m_per_s2=10, jerk_m_per_s3=200)),
        FINE, multisine(FINE, 0.3, "random"),
    ),
}  # fmt: skip


TARGET = 0.1
ALIGNMENTS = 40
RAMP_S, SECONDS = 0.5, 20.0


def row(name: str, axis: BeltAxis, lines, samples: np.ndarray) -> str:
    """Predicted/simulated for each quantity, and the following error when the excitation is switched on at rest."""
    at_m = axis.motion.cycle(axis.drive.rate_hz)[0]
    moves = len(at_m) > 1
    simulated = extremes(
        axis,
        samples,
        alignments=ALIGNMENTS if moves else 1,
        seconds=2 * len(at_m) / axis.drive.rate_hz if moves else 2.0,
    )
    predicted = worst(peaks(Waveform(lines, samples), belt_machine(axis)))
    cells, ratios = [], []
    for quantity, (low, high) in simulated.items():
        forecast, seen = predicted[quantity].size, max(high, -low)
        if quantity == "travel":  # of a moving axis the end at which it is predicted worst
            beyond = [(at_m.min() - predicted[quantity].low, at_m.min() - low)]
            beyond += [(predicted[quantity].high - at_m.max(), high - at_m.max())]
            forecast, seen = max(beyond, key=lambda pair: abs(pair[0] / pair[1] - 1) if moves else pair[1])
        ratios.append(forecast / seen)
        cells.append(f"{forecast:.3g} / {seen:.3g}")
    verdict = "met" if max(abs(r - 1) for r in ratios) <= TARGET else "missed"
    at_once, ramped = (f"{x:.2f}" if not moves else "" for x in started(axis, samples))
    span = f"{min(ratios):.3f} … {max(ratios):.3f}"
    return f"| {name} | {' | '.join(cells)} | {span}, {verdict} | {at_once} | {ramped} |"


def started(axis: BeltAxis, samples: np.ndarray) -> tuple[float, float]:
    """Largest following error from rest over that of the periodic state: switched on at once, and with a ramp."""
    ticks = np.arange(int(SECONDS * axis.drive.rate_hz))
    endless = np.resize(samples, ticks.size)
    settled = _following_error(replace(axis, excitation_n_m=samples, run_in_s=10.0, seconds=2.5))
    ramp = np.clip(ticks / (RAMP_S * axis.drive.rate_hz), 0, 1)
    from_rest = replace(axis, run_in_s=0.0, seconds=SECONDS)
    at_once = _following_error(replace(from_rest, excitation_n_m=endless))
    return at_once / settled, _following_error(replace(from_rest, excitation_n_m=endless * ramp)) / settled


def _following_error(axis: BeltAxis) -> float:
    block, truth = SimulatedAxis(axis).run()
    return float(np.max(np.abs(block["position_reference"] - truth.states[0])))


def main() -> int:
    print("| design | torque, N m | speed, m/s | travel beyond, m | following error, m | predicted over simulated "
          "| from rest at once | with a ramp |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|")
    for name, (axis, lines, samples) in (STANDSTILL | MOVING).items():
        print(row(name, axis, lines, samples), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
