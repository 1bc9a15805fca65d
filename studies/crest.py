"""Crest factors of flat multisines: Schroeder's phases, those of `low_crest_phases`, and the best of two long searches.

python -m studies.crest [--long]

One search is by our own method, the other by clipping. They take half an hour. Without --long they are left out, and
their earlier results are used.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from livebode.excitation import crest_between_samples, low_crest_phases, schroeder_phases
from studies.clipping import clipped_phases

TARGET = 1.05  # over the best
# Starts of the long search and of clipping, and the lowest crest factors that one of --long printed; seed 1000 for all.
LONG = {7: (20000, 1.4147), 21: (20000, 1.3682), 101: (3000, 1.3690)}
CLIPPING = {7: (100_000, 1.4128), 21: (100_000, 1.3728), 101: (20_000, 1.4178)}
LONG_SEED = 1000


def crest(count: int, phases: np.ndarray) -> float:
    return crest_between_samples(np.arange(1, count + 1), 1.0, phases)


def row(count: int, long: bool) -> str:
    """One line of the table, as Markdown."""
    began = time.perf_counter()
    found = crest(count, low_crest_phases(np.arange(1, count + 1)))
    seconds = time.perf_counter() - began
    (starts, own), (clipping_starts, clipped) = LONG[count], CLIPPING[count]
    if long:
        own = crest(count, low_crest_phases(np.arange(1, count + 1), seed=LONG_SEED, starts=starts))
        clipped = crest(count, clipped_phases(count, clipping_starts, LONG_SEED))
    best = min(own, clipped)
    verdict = "met" if found <= TARGET * best else "missed"
    return (
        f"| {count} | {crest(count, schroeder_phases(count)):.3f} | {found:.3f} | {seconds:.1f} s | {own:.4f} "
        f"| {starts} | {clipped:.4f} | {clipping_starts} | {found / best:.3f}, {verdict} |"
    )


def main(arguments: list[str]) -> int:
    print("| lines | Schroeder | low crest | in | long search | starts | clipping | starts | over the best, ≤ 1.05 |")
    print("|---|---|---|---|---|---|---|---|---|")
    for count in LONG:
        print(row(count, "--long" in arguments), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
