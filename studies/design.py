"""Peaks predicted by a design, compared with the simulated axis, in the periodic state and after a start from rest.

python -m studies.design
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from livebode.design import Waveform, belt_machine, peaks, worst
from livebode.simulation import BeltAxis, SimulatedAxis
from tests.design.test_predictions_truth import MOVING, STANDING
from tests.support.experiments import extremes

TARGET = 0.1
ALIGNMENTS = 40
RAMP_S, SECONDS = 0.5, 20.0


def row(name: str, axis: BeltAxis, lines, samples: np.ndarray) -> str:
    """Predicted/simulated for each quantity, and the following error when the excitation is switched on at rest."""
    at_m = axis.motion.cycle(axis.drive.rate_hz)[0]
    moves = len(at_m) > 1
    simulated = extremes(
        axis, samples, ALIGNMENTS if moves else 1, 2 * len(at_m) / axis.drive.rate_hz if moves else 2.0
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
    for name, (axis, lines, samples) in (STANDING | MOVING).items():
        print(row(name, axis, lines, samples), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
