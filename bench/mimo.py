"""The cost of matrices of responses, beside that of the channels they are from: `python -m bench.mimo`.

A tracker of n inputs and n outputs transforms u and y once. Beside it: n² ordinary trackers, one for each entry, which
is how the n · (1 + n) channels of n runs that excite one input each are tracked; and the kernel alone for these
channels, one at a time, without a response. Processor time, the least of several rounds, in microseconds for each
second of samples, in Blocks of four windows; "longer" is the joint estimate in Blocks of eight.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from bench.work import side_by_side
from livebode.core import Block, Lines
from livebode.estimation import Settings, Tracker
from livebode.excitation import MatrixExcitation
from livebode.kernel import SlidingDFT
from livebode_matrix import MatrixSettings, MatrixTracker

RATE_HZ, WINDOW, HOP, SECONDS_EACH = 4000.0, 400, 20, 2.0
LINES = Lines.parse("20:400:20", rate_hz=RATE_HZ, window=WINDOW)
SIZES = 1, 2, 4, 8
ESTIMATORS = "joint", "direct"
TARGET = 1.2


def recording(count: int) -> Block:
    """Signals of a plant of n × n gains, whose excitation rotates, with noise."""
    w = np.tile(MatrixExcitation.orthogonal(LINES, count, dwell=3, settle=1).samples, max(3, 24 // count))
    rng = np.random.default_rng(count)
    u = w + 0.01 * rng.standard_normal(w.shape)
    y = (np.eye(count) + 0.1 * rng.standard_normal((count, count))) @ u
    names = tuple(f"{role}{i}" for role in "wuy" for i in range(count))
    return Block(np.vstack([w, u, y]), names, rate_hz=RATE_HZ)


def of_matrices(blocks: list[Block], count: int, estimator: str) -> None:
    names = {role: [f"{role}{i}" for i in range(count)] for role in "wuy"}
    signals = {"output": names["y"], "input": names["u"], "excitation": names["w"]}
    settings = MatrixSettings(lines=LINES, **signals, estimator=estimator, dwell=3, settle=1, hop=HOP)
    tracker = MatrixTracker(settings)
    for block in blocks:
        tracker.process(block)


def of_channels(blocks: list[Block], count: int) -> None:
    for channel in range(count * (1 + count)):
        one = SlidingDFT(WINDOW, bins=LINES.bins)
        for block in blocks:
            one.process(block.data[channel % len(block.data)], hop=HOP)


def of_pairs(blocks: list[Block], count: int) -> None:
    """Each entry by an ordinary tracker."""
    for i in range(count):
        for o in range(count):
            names = {"excitation": f"w{i}", "input": f"u{i}", "output": f"y{o}"}
            tracker = Tracker(Settings(lines=LINES, **names, hop=HOP))
            for block in blocks:
                tracker.process(block)


def main() -> None:
    print(f"{len(LINES)} lines, window {WINDOW}, hop {HOP}, {RATE_HZ:g} Hz; µs for each second of samples")
    print("  n × n  channels  trackers     joint    direct    longer  joint/trackers  joint/channels  longer/channels")
    for count in SIZES:
        whole = recording(count)
        blocks, longer = ([whole.cut(at, at + n) for at in range(0, len(whole), n)] for n in (4 * WINDOW, 8 * WINDOW))
        tasks = {
            "channels": partial(of_channels, blocks, count),
            "trackers": partial(of_pairs, blocks, count),
            **{name: partial(of_matrices, blocks, count, name) for name in ESTIMATORS},
            "longer": partial(of_matrices, longer, count, "joint"),
        }
        found = side_by_side(tasks, SECONDS_EACH)
        channels, pairs, joint, direct, in_longer = (found[name] * 1e6 * RATE_HZ / len(whole) for name in tasks)
        ratios = joint / pairs, joint / channels, in_longer / channels
        print(
            f"  {count} × {count} {channels:9.0f} {pairs:9.0f} {joint:9.0f} {direct:9.0f} {in_longer:9.0f}"
            f" {ratios[0]:15.2f} {ratios[1]:15.2f} {ratios[2]:16.2f}"
            f"  {', '.join('met' if ratio <= TARGET else 'missed' for ratio in ratios)}"
        )


if __name__ == "__main__":
    main()
