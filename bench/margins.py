"""`python -m bench.margins`: margins with bounds for several fits, compared with python-control for one loop."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable

import control
import numpy as np

from livebode.margins import margins, tuning
from tools.loops import BELT, Case, parameters

CASE = Case(BELT, gain=3 * 0.2308, delay_ticks=8)
BAND_HZ = (20.0, 140.0)


def seconds(work: Callable[[], object]) -> float:
    """Best time of five."""
    work()
    found = []
    for _ in range(5):
        began = time.perf_counter()
        work()
        found.append(time.perf_counter() - began)
    return min(found)


def main() -> None:
    transfer = np.prod(CASE.factors)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        alone = seconds(lambda: control.stability_margins(transfer))
        polynomial = seconds(lambda: control.stability_margins(transfer, method="poly"))
    print(f"python-control, one loop, no bounds: {1e3 * alone:.1f} ms (by polynomials {1e3 * polynomial:.1f} ms)")
    for rows in (1, 8, 64, 512):
        stiffness = np.linspace(0.8, 1.3, rows)
        belts = BELT * np.column_stack([np.ones(rows), np.ones(rows), stiffness, np.ones(rows)])
        fits = parameters(belts, np.array([np.diag((0.01 * belt) ** 2) for belt in belts]))
        each = seconds(lambda fits=fits: margins(fits, CASE.open, BAND_HZ)) / rows
        print(f"livebode, {rows:3} fits at once, bounds: {1e3 * each:.2f} ms per fit, {alone / each:.1f} times as fast")
    print(f"a proposal over 32 places: {seconds(lambda: tuning(fits, CASE.open, BAND_HZ)):.2f} s")


if __name__ == "__main__":
    main()
