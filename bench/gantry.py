"""Speed of the simulated machines with two motors in their loops: `python -m bench.gantry`.

Simulated seconds for each second of processor time, at 4,000 Hz, the median of several rounds.
"""

from __future__ import annotations

import time

import numpy as np

from livebode.simulation import CoreXYLoop, GantryLoop, MotorLoop

SECONDS, ROUNDS, TARGET = 20.0, 7, 50.0
LOOPS: dict[str, MotorLoop] = {"gantry": GantryLoop(), "CoreXY": CoreXYLoop()}


def times_real_time(loop: MotorLoop) -> float:
    rng = np.random.default_rng(0)
    samples = int(SECONDS * loop.rate_hz)
    w, noise = rng.standard_normal((2, samples)), rng.standard_normal((len(loop.mechanism.outputs), samples))
    taken = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        loop.simulate(w, noise=noise)
        taken.append(time.process_time() - begin)
    return SECONDS / float(np.median(taken))


def main() -> None:
    for name, loop in LOOPS.items():
        found = times_real_time(loop)
        print(f"{name}: {found:.0f} × real time (≥ {TARGET:g}: {'met' if found >= TARGET else 'missed'})")


if __name__ == "__main__":
    main()
