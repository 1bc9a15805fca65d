"""The simulated axis: speed relative to real time by processor time, and error relative to solve_ivp over a stroke.

python -m bench.axis
"""

from __future__ import annotations

import time

import numpy as np

from livebode.core import Lines
from livebode.excitation import multisine
from livebode.simulation import Backlash, BeltAxis, Friction, Mechanics, Sensor, SimulatedAxis, Strokes
from tools.motion_equations import stroke_error

RATIO_TARGET, ERROR_TARGET, SECONDS = 100.0, 1e-6, 60.0
EXCITATION = multisine(Lines.parse("20:140:20", rate_hz=4000, window=400))
PLAY = (Backlash(gap_m=1e-4),)
CASES = {
    "two masses": {},
    "two masses, friction 15 N, noise": {
        "friction": Friction(load_coulomb_n=15.0),
        "sensor": Sensor(noise_rad_per_s=0.1, encoder_counts_per_turn=1 << 20),
    },
    "two masses, play of 0.1 mm": {"faults": PLAY},
    "three masses": {"mechanics": Mechanics(masses=3)},
    "three masses, friction 15 N, noise": {
        "mechanics": Mechanics(masses=3), "friction": Friction(load_coulomb_n=15.0),
        "sensor": Sensor(noise_rad_per_s=0.1, encoder_counts_per_turn=1 << 20),
    },
    "three masses, play of 0.1 mm": {"mechanics": Mechanics(masses=3), "faults": PLAY},
}  # fmt: skip


def ratio(options: dict) -> float:
    """Simulated time over processor time, best of three, including Blocks and truth."""
    axis = SimulatedAxis(BeltAxis(motion=Strokes(), excitation_n_m=EXCITATION, seconds=SECONDS, **options))
    best = 0.0
    for _ in range(3):
        start = time.thread_time()
        for _ in axis.pairs():
            pass
        best = max(best, SECONDS / (time.thread_time() - start))
    return best


def play_error(masses: int) -> float:
    """Largest difference over a stroke with play from 256 equal steps per tick, relative to each state's largest."""
    seconds = len(Strokes().cycle(4000)[0]) / 2 / 4000
    chosen, fine = (
        SimulatedAxis(
            BeltAxis(
                mechanics=Mechanics(masses=masses), motion=Strokes(), excitation_n_m=EXCITATION, seconds=seconds,
                faults=PLAY, substeps=substeps,
            )
        ).run()[1].states
        for substeps in (None, 256)
    )  # fmt: skip
    return float(np.max(np.abs(chosen - fine) / np.max(np.abs(fine), axis=1, keepdims=True)))


def verdict(reached: bool) -> str:
    return "met" if reached else "missed"


def main() -> None:
    print(f"{SECONDS:g} s of strokes at 0.38 m/s under the multisine, ticks of 250 µs, one core")
    for name, options in CASES.items():
        found = ratio(options)
        thousand_s = 1000 * len(Strokes().cycle(4000)[0]) / 2 / 4000 / found
        print(f"{name:36}{found:7.0f} × real time, target ≥ {RATIO_TARGET:g}: {verdict(found >= RATIO_TARGET)}; "
              f"a thousand strokes in {thousand_s:.0f} s")  # fmt: skip
    print("largest error over a stroke, relative to each state's largest value, against solve_ivp at rtol 1e-11")
    for masses in (2, 3):
        error = play_error(masses)
        print(f"{masses} masses, play, against 256 steps{error:10.1e}, target ≤ {ERROR_TARGET:g}: "
              f"{verdict(error <= ERROR_TARGET)}")  # fmt: skip
        for rubbing in (False, True):
            error = stroke_error(masses, rubbing, "DOP853", Strokes())
            name = f"{masses} masses{', friction' if rubbing else ''}"
            print(f"{name:36}{error:10.1e}, target ≤ {ERROR_TARGET:g}: {verdict(error <= ERROR_TARGET)}")


if __name__ == "__main__":
    main()
