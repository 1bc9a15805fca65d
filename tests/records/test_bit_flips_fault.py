"""A bit is flipped in any file of a run: it is named, and all that is not damaged is read by every command.

`make damage` flips many more.
"""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import numpy as np

from tests.support.damaged import check_flip, make_runs

FLIPS = int(os.environ.get("LIVEBODE_DAMAGE_FLIPS", "6"))


def test_each_flipped_bit_is_named_and_the_rest_is_read(tmp_path: Path) -> None:
    rng, runs = np.random.default_rng(12), list(make_runs(tmp_path).values())
    kinds: Counter[tuple[str, str]] = Counter()
    named = 0
    for number in range(FLIPS):
        run = runs[number % len(runs)]
        kind, known = check_flip(run, tmp_path, rng)
        kinds[run.name, kind] += 1
        named += known
        if not (number + 1) % 100:
            print(f"{number + 1} flips", flush=True)
    for (run_name, kind), count in sorted(kinds.items()):
        print(f"{run_name:10} {kind:20} {count:5} flips")
    print(f"{FLIPS} flips: {named} named, {FLIPS - named} without effect, none silent; all else was read")
