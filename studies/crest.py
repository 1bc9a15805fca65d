"""Crest factors of flat multisines: Schroeder's phases, those of `low_crest_phases`, and the best of a long search.

python -m studies.crest [--long]

Without --long the long search is left out, which takes a quarter of an hour; what it found earlier stands in.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from livebode.excitation import crest_between_samples, low_crest_phases, schroeder_phases

TARGET = 1.05  # over the best
# Starts of the long search, and the lowest crest factor that one of --long printed; seed 1000 for all.
LONG = {7: (20000, 1.4147), 21: (20000, 1.3682), 101: (3000, 1.3690)}
LONG_SEED = 1000


def crest(count: int, phases: np.ndarray) -> float:
    return crest_between_samples(np.arange(1, count + 1), 1.0, phases)


def row(count: int, long: bool) -> str:
    """One line of the table, as Markdown."""
    began = time.perf_counter()
    found = crest(count, low_crest_phases(np.arange(1, count + 1)))
    seconds = time.perf_counter() - began
    starts, best = LONG[count]
    if long:
        best = crest(count, low_crest_phases(np.arange(1, count + 1), seed=LONG_SEED, starts=starts))
    verdict = "reached" if found <= TARGET * best else "SHORT"
    return (
        f"| {count} | {crest(count, schroeder_phases(count)):.3f} | {found:.3f} | {seconds:.1f} s | {best:.4f} "
        f"| {starts} | {found / best:.3f}, {verdict} |"
    )


def main(arguments: list[str]) -> int:
    print("| lines | Schroeder | low crest | in | best of the long search | its starts | low crest over best, ≤ 1.05 |")
    print("|---|---|---|---|---|---|---|")
    for count in LONG:
        print(row(count, "--long" in arguments), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
