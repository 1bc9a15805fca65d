"""The cost of matrices of responses, beside that of the channels they are from: `python -m bench.mimo`.

A tracker of n inputs and n outputs transforms w, u and y once. Beside it: the n · (1 + n) channels of n runs that
excite one input each, through the same kernel one at a time, without an estimate; and n² ordinary trackers, one for
each entry. Processor time, the least of several rounds, in microseconds for each second of samples.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from bench.work import side_by_side
from livebode.core import Block, Lines
from livebode.estimation import Settings, Tracker
from livebode.kernel import SlidingDFT
from livebode.mimo import MatrixExcitation, MatrixSettings, MatrixTracker

RATE_HZ, WINDOW, HOP, SECONDS_EACH = 4000.0, 400, 20, 2.0
LINES = Lines.parse("20:400:20", rate_hz=RATE_HZ, window=WINDOW)
SIZES = 1, 2, 4, 8
ESTIMATORS = "joint", "direct"


def recording(count: int) -> list[Block]:
    """Signals of a plant of n × n gains, whose excitation rotates, with noise, in Blocks of four windows."""
    w = np.tile(MatrixExcitation.orthogonal(LINES, count, dwell=3, settle=1).samples, max(3, 24 // count))
    rng = np.random.default_rng(count)
    u = w + 0.01 * rng.standard_normal(w.shape)
    y = (np.eye(count) + 0.1 * rng.standard_normal((count, count))) @ u
    names = tuple(f"{role}{i}" for role in "wuy" for i in range(count))
    data = np.vstack([w, u, y])
    starts = range(0, data.shape[1], 4 * WINDOW)
    return [Block(data[:, at : at + 4 * WINDOW], names, rate_hz=RATE_HZ, start=at) for at in starts]


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
    print("  n × n  channels  trackers     joint    direct   joint/channels  joint/trackers")
    for count in SIZES:
        blocks = recording(count)
        seconds = sum(map(len, blocks)) / RATE_HZ
        tasks = {
            "channels": partial(of_channels, blocks, count),
            "trackers": partial(of_pairs, blocks, count),
            **{name: partial(of_matrices, blocks, count, name) for name in ESTIMATORS},
        }
        found = side_by_side(tasks, SECONDS_EACH)
        channels, pairs, joint, direct = (found[name] * 1e6 / seconds for name in tasks)
        print(
            f"  {count} × {count} {channels:9.0f} {pairs:9.0f} {joint:9.0f} {direct:9.0f}"
            f" {joint / channels:16.2f} {joint / pairs:15.2f}"
        )


if __name__ == "__main__":
    main()
