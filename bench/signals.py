"""What the tap of the raw signals costs the thread that tracks.

    python -m bench.signals [--rounds 40] [--block 40]

Tracks the same samples in turns with a hub without tap, with one that nobody watches, and with one that a page watches,
whose requests another thread answers five times per second as the server does. The cost is processor time of the
tracking thread, as a ratio to the first hub in the same turn, so that a busy computer does not change it. Other
processes make it scatter by some per cent; the time of the tap alone is more precise.
"""

from __future__ import annotations

import argparse
import threading
import time

import numpy as np

from livebode.core import Block, Channel, Lines
from livebode.dashboard import Hub
from livebode.dashboard.signal_answer import answer
from livebode.dashboard.signal_tap import SignalTap
from livebode.estimation import Settings, Tracker
from livebode.runtime import Channels, TrackerResults

RATE_HZ, WINDOW, SECONDS = 4000.0, 400, 4.0
CHANNELS = tuple(Channel(name, unit) for name, unit in {"w": "N m", "u": "N m", "y": "rad/s", "x": "m"}.items())
IDLE_MAX, WATCHED_MAX = 0.01, 0.03
EVERY_S = 0.2


class NoTap(SignalTap):
    """Takes nothing."""

    def add(self, block: Block, now_s: float) -> None:
        """Nothing."""


def blocks(samples: int) -> list[Block]:
    """Noise on four channels, in Blocks of so many samples."""
    data = np.random.default_rng(0).standard_normal((len(CHANNELS), int(SECONDS * RATE_HZ)))
    data[3] = 0.9 + 0.6 * np.sin(np.arange(data.shape[1]) / RATE_HZ)
    starts = range(0, data.shape[1], samples)
    return [Block(data[:, at : at + samples].copy(), CHANNELS, RATE_HZ, start=at) for at in starts]


def cost_s(hub: Hub, stream: list[Block], settings: Settings) -> float:
    """Processor time of this thread for tracking and publishing them."""
    tracker = Tracker(settings)
    began = time.thread_time()
    for block in stream:
        responses = tracker.process(block)
        if len(responses):
            hub(responses)
        hub(TrackerResults(block, block.stop, None))
    spent = time.thread_time() - began
    hub.drain()
    return spent


def alone_s(stream: list[Block], *, watched: bool) -> float:
    """Processor time of the tap itself for a Block: the least of 50 turns."""
    tap, costs = SignalTap(), []
    tap.begin(CHANNELS, WINDOW)
    for _ in range(50):
        if watched:
            tap.watch()
        now_s, began = time.monotonic(), time.thread_time()
        for block in stream:
            tap.add(block, now_s)
        costs.append((time.thread_time() - began) / len(stream))
    return min(costs)


class Page(threading.Thread):
    """Asks for the signals until `end` is set."""

    def __init__(self, hub: Hub, lines: Lines) -> None:
        super().__init__()
        self.hub, self.lines, self.end = hub, lines, threading.Event()
        self.costs: list[float] = []

    def run(self) -> None:
        """Answer as the server does."""
        while not self.end.wait(EVERY_S):
            began = time.thread_time()
            self.hub.signals.watch()
            if (block := self.hub.signals.newest()) is not None:
                answer(block, self.lines, "log")
                self.costs.append(time.thread_time() - began)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument("--block", type=int, default=40)
    asked = parser.parse_args()
    lines = Lines.parse("20:140:10", RATE_HZ, WINDOW)
    settings = Settings(lines=lines, output="y", input="u", excitation="w", schedule="x", hop=40)
    hubs = {name: Hub(name) for name in ("without", "idle", "watched")}
    hubs["without"].signals = NoTap()
    for hub in hubs.values():
        hub(Channels(CHANNELS, RATE_HZ))
    stream, page = blocks(asked.block), Page(hubs["watched"], lines)
    hubs["watched"].signals.watch()
    page.start()
    found: dict[str, list[float]] = {name: [] for name in hubs}
    for turn in range(asked.rounds):
        names = list(hubs)
        for name in names[turn % 3 :] + names[: turn % 3]:
            found[name].append(cost_s(hubs[name], stream, settings))
    page.end.set()
    page.join()
    per_block = 1e6 / len(stream)
    print(f"{RATE_HZ:.0f} Hz, 4 channels, {len(lines)} lines, blocks of {asked.block} samples, {asked.rounds} turns")
    print(f"tracking without a tap   {np.median(found['without']) * per_block:7.1f} µs per block")
    for name, words, most in (("idle", "nobody watches", IDLE_MAX), ("watched", "one page watches", WATCHED_MAX)):
        ratio = np.array(found[name]) / np.array(found["without"]) - 1
        low, median, high = 100 * np.quantile(ratio, (0.25, 0.5, 0.75))
        met = "met" if median <= 100 * most else "missed"
        alone = 1e6 * alone_s(stream, watched=name == "watched")
        print(
            f"{words:22s} {median:+9.2f} % (quartiles {low:+.2f} … {high:+.2f}), target ≤ {100 * most:.0f} %: {met}; "
            f"the tap alone {alone:.2f} µs"
        )
    print(f"server, each answer      {1e3 * np.median(page.costs):7.2f} ms of its own thread, 5 answers/s")


if __name__ == "__main__":
    main()
