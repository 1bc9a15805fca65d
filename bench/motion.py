"""What the motion correction adds to a tracker, and its parts in C against NumPy and SciPy.

    python -m bench.motion [--minutes 10]

The simulated axis strokes with 0.38 m/s: four signals at 4 kHz, 7 lines, window 400, chunks of 4 s. The correction is
computed at the end of a chunk, so each figure is a mean over a whole run: processor time of the thread in microseconds
a sample, the least of several rounds, with all scans. `adds` is the difference to a tracker that receives the same
blocks. The parts are those of one chunk; the last column is how much faster C is.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from livebode.core import Block, Lines
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.kernel import (
    BeltCourse,
    BeltGrid,
    BeltMasses,
    BeltRows,
    CurveShape,
    belt_each,
    belt_replay,
    belt_response,
    curve_at,
)
from livebode.motion import MotionCorrection
from livebode.simulation import BeltAxis, Pair, Sensor, SimulatedAxis, Strokes, open_belt
from tests.twins import belt as belt_twin

RATE_HZ, WINDOW, CHUNK_S, RADIUS_M = 4000.0, 400, 4.0, 0.019
LINES = Lines.parse("20:140:20", RATE_HZ, WINDOW)
SHORT_S, ROUNDS, CALLS = 60.0, 3, 20
ROWS, TICKS = 160, 18_400  # of the fit and of the replay of a chunk
TARGET_US = 2.0


@dataclass(frozen=True)
class Load:
    """How the samples come."""

    name: str
    seconds: float
    block_s: float
    hop: int


def loads(minutes: float) -> list[Load]:
    recorded = f"recorded, {minutes:g} min"
    return [
        Load("live, 25 ms, 20/s", SHORT_S, 0.025, 200),
        Load("live, 100 ms, 20/s", SHORT_S, 0.1, 200),
        Load("live, 500 ms, 20/s", SHORT_S, 0.5, 200),
        Load("live, 100 ms, 200/s", SHORT_S, 0.1, 20),
        Load("live, 500 ms, 200/s", SHORT_S, 0.5, 20),
        Load(f"{recorded}, 20/s", 60 * minutes, 60.0, 200),
        Load(f"{recorded}, 200/s", 60 * minutes, 60.0, 20),
    ]


def samples(seconds: float) -> Block:
    sensor = Sensor(noise_rad_per_s=0.1)
    axis = BeltAxis(motion=Strokes(), excitation_n_m=multisine(LINES), sensor=sensor, seconds=seconds)
    parts = list(SimulatedAxis(axis).blocks(["w", "u", "velocity", "x"]))
    return Block(np.concatenate([part.data for part in parts], axis=1), parts[0].channels, RATE_HZ)


def spent_us(estimator: Tracker | MotionCorrection, whole: Block, block: int) -> float:
    """Microseconds a sample."""
    pieces = [whole.cut(at, min(at + block, len(whole))) for at in range(0, len(whole), block)]
    begun = time.thread_time()
    for piece in pieces:
        estimator.process(piece)
    estimator.finish()
    return 1e6 * (time.thread_time() - begun) / len(whole)


def costs(load: Load, whole: Block) -> tuple[float, float]:
    """Of a tracker, and of a correction."""
    settings = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x", hop=load.hop)
    cut, block = whole.cut(0, round(load.seconds * RATE_HZ)), round(load.block_s * RATE_HZ)
    chunk = round(CHUNK_S * RATE_HZ)
    tracker, corrected = [], []
    for _ in range(ROUNDS):
        tracker.append(spent_us(Tracker(settings), cut, block))
        correction = MotionCorrection(settings, radius_m=RADIUS_M, chunk_samples=chunk)
        corrected.append(spent_us(correction, cut, block))
    return min(tracker), min(corrected)


def parts() -> list[tuple[str, Callable[[], object], Callable[[], object]]]:
    """Name, in C, and by NumPy or SciPy."""
    rng = np.random.default_rng(0)
    grid = BeltGrid.of(LINES.z, RATE_HZ)
    parameters = np.log([0.0028, 2.4e-3, 180.0, 0.05]) + 0.1 * rng.normal(size=(ROWS, 4))
    rows = BeltRows(belt_response(grid, parameters), np.ones((ROWS, len(LINES))))
    way = np.linspace(0.25, 1.6, TICKS)
    knots = np.concatenate([np.full(3, 0.25), np.linspace(0.25, 1.6, 6), np.full(3, 1.6)])
    shape = CurveShape(knots, rng.normal(size=8), 0.1, 0.0, 0.0)
    spline = BSpline(knots, shape.weights, 3)
    masses, flat, torque = BeltMasses(0.003, 6.7, RADIUS_M), np.ones(TICKS), rng.normal(size=TICKS)
    course = BeltCourse(RATE_HZ, 5e5 * flat, 100 * flat, torque)
    pair = [Pair(masses.inertia_kg_m2, masses.load_kg)]
    return [
        ("responses, NumPy", lambda: belt_response(grid, parameters), lambda: belt_twin.response(grid, parameters)),
        (
            "normal equations, NumPy",
            lambda: belt_each(grid, rows, parameters),
            lambda: belt_twin.each(grid, rows, parameters),
        ),
        ("curve over the position, SciPy", lambda: curve_at(shape, way), lambda: spline(way)),
        (
            "replay, the simulator's C",
            lambda: belt_replay(masses, course),
            lambda: open_belt(pair, torque, 5e5 * flat, 100 * flat, rate_hz=RATE_HZ, radius_m=RADIUS_M),
        ),
    ]


def least_us(call: Callable[[], object]) -> float:
    found = []
    for _ in range(CALLS):
        begun = time.thread_time()
        call()
        found.append(time.thread_time() - begun)
    return 1e6 * min(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0, help="length of the recording [default: 10]")
    minutes = parser.parse_args().minutes
    whole = samples(max(60 * minutes, SHORT_S))
    print(f"{'µs a sample':32}{'tracker':>10}{'corrected':>11}{'adds':>8}   target ≤ {TARGET_US:g}")
    for load in loads(minutes):
        tracker, corrected = costs(load, whole)
        added = corrected - tracker
        verdict = "met" if added <= TARGET_US else "missed"
        print(f"{load.name:32}{tracker:10.2f}{corrected:11.2f}{added:8.2f}   {verdict}")
    print(f"\n{'µs a call, of one chunk':32}{'C':>10}{'other':>11}{'ratio':>8}")
    for name, ours, theirs in parts():
        one, other = least_us(ours), least_us(theirs)
        print(f"{name:32}{one:10.0f}{other:11.0f}{other / one:8.1f}")


if __name__ == "__main__":
    main()
