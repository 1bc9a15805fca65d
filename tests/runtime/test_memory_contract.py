"""What a run holds in memory does not grow with its length: the short form of `make soak`."""

from __future__ import annotations

import gc
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from livebode.configuration import RecordSection
from livebode.core import Block, Channel, Lines
from livebode.estimation import Settings, Tracker
from livebode.runtime.run_counts import REPEATS_MAX
from tests.support.runs import record

RATE_HZ, WINDOW, HOP, BLOCK = 1000.0, 50, 25, 5
NAMES = ("w", "u", "y")
WARM_UP, BLOCKS = 800, 1600


class Machine:
    """Sends small blocks, most of which bring no response, and notes what the process holds on the way."""

    channels = tuple(Channel(name, "") for name in NAMES)
    samples = BLOCKS * BLOCK

    def __init__(self) -> None:
        self.held: list[Counter[str]] = []

    def blocks(self, _: Sequence[str]) -> Iterator[Block]:
        data = np.random.default_rng(0).standard_normal((3, BLOCK))
        for n in range(BLOCKS):
            if n in (WARM_UP, BLOCKS - 1):
                gc.collect()
                kinds = (type(one) for one in gc.get_objects())
                self.held.append(
                    Counter(kind.__name__ for kind in kinds if str(kind.__module__).startswith("livebode."))
                )
            # Every hundredth block is missing, so that events come as well.
            if n % 100 != 99:
                yield Block(data * (1 + n % 7), NAMES, RATE_HZ, start=n * BLOCK)


def test_a_run_holds_no_more_after_twice_the_blocks(tmp_path: Path) -> None:
    machine = Machine()
    settings = Settings(lines=Lines((4, 7), WINDOW, RATE_HZ), output="y", input="u", excitation="w", hop=HOP)
    record(machine, Tracker(settings), tmp_path / "run", segments=RecordSection(segment_s=5.0), again=False)
    warm, end = machine.held
    # 64 parts of the thinned copy, events that wait for the next report, and lines of the manifest: for a segment of
    # 5 s those of its responses, its parameters and its means over 1 s, 1 min and 1 h.
    bounds = {"Responses": 70, "Event": REPEATS_MAX, "Segment": 5 * BLOCKS * BLOCK / RATE_HZ / 5.0}
    # What the thread may hold that merges segments meanwhile: 16 tables, the one they become, and 26 fields of their
    # schemas. Counted at every second block, three runs had up to 17 tables and 26 fields more, always the same.
    bounds |= {"Table": 17, "Field": 26}
    grown = {name: count - warm[name] for name, count in end.items() if count - warm[name] > bounds.get(name, 10)}
    assert grown == {}
