"""`python -m bench.margins`: margins with bounds in C, by NumPy (as for any other plant), and by python-control."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import replace

import control
import numpy as np

from livebode.analysis import margins
from livebode.fitting import TwoMass
from livebode_control.tuning.filter_proposal import tuning
from tools.loops import BELT, Case, parameters

CASE = Case(BELT, gain=3 * 0.2308, delay_ticks=8)
BAND_HZ = (20.0, 140.0)
TARGET_MS = 0.3


class NumpyTwoMass(TwoMass):
    """The same model as a user's own, whose margins NumPy reads."""


def seconds(work: Callable[[], object]) -> float:
    """Least processor time of five."""
    work()
    found = []
    for _ in range(5):
        began = time.thread_time()
        work()
        found.append(time.thread_time() - began)
    return min(found)


def main() -> None:
    transfer = np.prod(CASE.factors)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        alone = seconds(lambda: control.stability_margins(transfer))
        polynomial = seconds(lambda: control.stability_margins(transfer, method="poly"))
    print(f"python-control, one loop, no bounds: {1e3 * alone:.1f} ms (by polynomials {1e3 * polynomial:.1f} ms)")
    native = CASE.open
    numpy_ = replace(native, plant=NumpyTwoMass(radius_m=0.019))
    for rows in (1, 8, 64, 512):
        stiffness = np.linspace(0.8, 1.3, rows)
        belts = BELT * np.column_stack([np.ones(rows), np.ones(rows), stiffness, np.ones(rows)])
        fits = parameters(belts, np.array([np.diag((0.01 * belt) ** 2) for belt in belts]))
        new, old = (seconds(lambda fits=fits, of=of: margins(fits, of, BAND_HZ)) / rows for of in (native, numpy_))
        verdict = f"target ≤ {TARGET_MS:g} ms: {'met' if 1e3 * new <= TARGET_MS else 'missed'}"
        print(
            f"livebode, {rows:3} fits at once, bounds: {1e3 * new:.3f} ms per fit, NumPy {old / new:.1f} ×, "
            f"python-control {alone / new:.1f} ×   {verdict}"
        )
    print(f"a proposal over 32 places: {seconds(lambda: tuning(fits, native, BAND_HZ)):.2f} s")


if __name__ == "__main__":
    main()
