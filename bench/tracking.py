"""Where the time of a tracker goes, in small blocks and in whole recordings, and its stages in C against NumPy's.

    python -m bench.tracking [--minutes 10]

Three signals at 4 kHz, joint estimator, window 400. Processor time of the thread in milliseconds per second of the
machine, the least of several rounds; of blocks, the median block. `kernel` is the sliding DFT, `samples` what is
checked and cut before it, `lines` the line stage, `repeating` the errors that repeat with the excitation, and `rest`
blocks, times, events and the Responses. The last three columns use the NumPy twins of the line stage
(`tests/twins/lines.py`) and of the verdicts on lines (`tests/twins/repeating.py`), with the same results
to the bit, in the same rounds.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np

from bench.fleet_loads import samples_of
from livebode.core import Block, Lines, Responses
from livebode.estimation import LineSpectra, LineStage, Settings, Tracker, line_stage
from livebode.estimation.repeating import RepeatingErrors
from livebode.estimation.verdicts import Judge
from livebode.kernel import SlidingDFT
from tests.twins import lines as line_twin
from tests.twins import repeating as repeating_twin

RATE_HZ, WINDOW, ROUNDS = 4000.0, 400, 5
SMALL_S = 30.0
TARGET = 0.25
_PARTS = {
    "kernel": (SlidingDFT, "process"),
    "samples": (LineSpectra, "process"),
    "lines": (LineStage, "process"),
    "repeating": (RepeatingErrors, "process"),
}


@dataclass(frozen=True)
class Load:
    """What a tracker receives."""

    name: str
    lines: str
    hop: int
    block_s: float
    seconds: float


def loads(minutes: float) -> list[Load]:
    """Blocks of a fleet, and whole recordings in parts that fit into memory."""
    few, many, whole_s = "20:140:20", "20:220:10", 60 * minutes
    return [
        Load("7 lines, 200/s, 100 ms", few, 20, 0.1, SMALL_S),
        Load("7 lines, 200/s, 500 ms", few, 20, 0.5, SMALL_S),
        Load("7 lines, 20/s, 500 ms", few, 200, 0.5, SMALL_S),
        Load(f"21 lines, 20/s, {minutes:g} min", many, 200, 60.0, whole_s),
        Load(f"21 lines, 200/s, {minutes:g} min", many, 20, 60.0, whole_s),
    ]


def blocks_of(load: Load) -> list[Block]:
    """The simulated axis, with noise of its own in each second."""
    signals, channels = samples_of(moving=False)
    count = round(load.seconds * RATE_HZ)
    data = signals[:, np.arange(count) % signals.shape[1]]
    data[2] += 1e-3 * np.random.default_rng(0).standard_normal(count)
    size = round(load.block_s * RATE_HZ)
    return [Block(data[:, at : at + size], channels, rate_hz=RATE_HZ, start=at) for at in range(0, count, size)]


def tracker_of(load: Load) -> Tracker:
    lines = Lines.parse(load.lines, RATE_HZ, WINDOW)
    return Tracker(Settings(lines=lines, output="velocity", input="u", excitation="w", hop=load.hop))


@contextmanager
def timed(spent: dict[str, float]) -> Iterator[None]:
    """Add the processor time of each part to `spent`."""

    def wrapped(name: str, work: Callable[..., Any]) -> Callable[..., Any]:
        def measured(*arguments: Any, **named: Any) -> Any:
            begun = time.thread_time()
            found = work(*arguments, **named)
            spent[name] += time.thread_time() - begun
            return found

        return measured

    with ExitStack() as stack:
        for name, (owner, method) in _PARTS.items():
            stack.enter_context(patch.object(owner, method, wrapped(name, getattr(owner, method))))
        yield


@contextmanager
def with_twin() -> Iterator[None]:
    """Trackers whose line stage and verdicts on lines are NumPy's."""
    process = patch.object(line_stage, "process_lines", line_twin.process_lines)
    with process, patch.object(Judge, "process", repeating_twin.process):
        yield


def costs(load: Load, blocks: list[Block]) -> dict[str, float]:
    """Milliseconds per second of the machine, of the median block: of the tracker, and of each part."""
    tracker, found = tracker_of(load), []
    warm = min(4, len(blocks) - 1)
    spent = dict.fromkeys(("tracker", *_PARTS), 0.0)
    with timed(spent):
        for block in blocks:
            spent.update(dict.fromkeys(spent, 0.0))
            begun = time.thread_time()
            tracker.process(block)
            spent["tracker"] = time.thread_time() - begun
            found.append({name: 1e3 * s / load.block_s for name, s in spent.items()})
    of_block = {name: float(np.median([one[name] for one in found[warm:]])) for name in spent}
    return of_block | {"samples": of_block["samples"] - of_block["kernel"]}


def least(rounds: list[dict[str, float]]) -> dict[str, float]:
    return {name: min(one[name] for one in rounds) for name in rounds[0]}


def row(load: Load) -> str:
    """A line of the table."""
    blocks, in_c, in_numpy = blocks_of(load), [], []
    for _ in range(ROUNDS):
        in_c.append(costs(load, blocks))
        with with_twin():
            in_numpy.append(costs(load, blocks))
    c, twin = least(in_c), least(in_numpy)
    parts = [c[name] for name in _PARTS]
    shares = [share / c["tracker"] for share in (*parts, c["tracker"] - sum(parts))]
    ratios = [c[name] / twin[name] for name in ("lines", "repeating")]
    verdicts = [f"{ratio:.2f}, {'met' if ratio <= TARGET else 'missed'}" for ratio in ratios]
    whole = f"{c['tracker']:.3f}", *(f"{share:.0%}" for share in shares), f"{c['tracker'] / twin['tracker']:.2f}"
    return " | ".join(["| " + load.name, *whole, *verdicts]) + " |"


def same_bits(load: Load) -> bool:
    """Whether both ways give the same responses."""
    some = blocks_of(load)[:2]

    def found() -> Responses:
        tracker = tracker_of(load)
        return Responses.join([tracker.process(block) for block in some])

    ours = found()
    with with_twin():
        return ours.equals(found())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.tracking", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    every = loads(parser.parse_args().minutes)
    if not all(map(same_bits, every)):
        raise SystemExit("the twin gives other responses")
    print(
        "| load | tracker, ms/s | kernel | samples | lines | repeating | rest | tracker / twin "
        f"| lines / twin, target ≤ {TARGET:g} | repeating / twin, target ≤ {TARGET:g} |"
    )
    print("|---" * 10 + "|")
    for load in every:
        print(row(load), flush=True)


if __name__ == "__main__":
    main()
