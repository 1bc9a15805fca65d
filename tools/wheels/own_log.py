"""Writes a recording as a user would have it, from the standard library alone.

A multisine of five lines drives a first-order lag; input and output have noise. The columns are t, w (the excitation),
u and y. With a pause between the rows the file grows as a live log does.
"""

from __future__ import annotations

import math
import random
import sys
import time
from collections.abc import Iterator

RATE_HZ, WINDOW, LINES = 1000.0, 200, (2, 5, 9, 14, 21)
TIME_CONSTANT_S, GAIN, NOISE = 0.02, 3.0, 0.01
BLOCK = 50  # rows written together


def rows(count: int) -> Iterator[str]:
    chance, state = random.Random(1), 0.0
    decay = math.exp(-1 / (RATE_HZ * TIME_CONSTANT_S))
    yield "t,w,u,y\n"
    for n in range(count):
        w = sum(math.cos(2 * math.pi * k * n / WINDOW + k * k) for k in LINES)
        u, y = w + NOISE * chance.gauss(0, 1), state + NOISE * chance.gauss(0, 1)
        yield f"{n / RATE_HZ:.4f},{w:.9g},{u:.9g},{y:.9g}\n"
        state = decay * state + (1 - decay) * GAIN * w


def main() -> None:
    path, count, pause_s = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    with open(path, "w", encoding="utf-8") as log:
        for number, row in enumerate(rows(count)):
            log.write(row)
            if pause_s and number % BLOCK == 0:
                log.flush()
                time.sleep(pause_s)


if __name__ == "__main__":
    main()
