"""Two channels pushed in C and their FRF every 20 samples, compared with an optimised 6-parameter RLS in C."""

from functools import partial
from typing import Any

import numpy as np
from scipy.signal import lfilter

from bench import native_build
from bench.work import HOP, side_by_side, signal
from livebode.kernel import instruction_set

RLS = ("rls_loops", "rls_rows", "rls_triangle")
SETS = ("best", "baseline", "avx2", "avx512")


def measure(seconds: float) -> list[dict[str, Any]]:
    library, length, window = native_build.peers(), 20_000, 400
    u = signal(length)
    y = lfilter([0, 1.0, 0.5], [1, -1.5, 0.8, -0.1], u) + 0.01 * signal(length + 1)[1:]
    work = (u.ctypes.data, y.ctypes.data, length)
    records = []
    for count in (7, 21, 101):
        bins = np.arange(1, count + 1, dtype=np.uint32)
        tracker = library.frf_new(window, count, bins.ctypes.data, SETS.index(instruction_set()))
        tasks: dict[str, Any] = {name: partial(getattr(library, name), *work, 0.995) for name in RLS}
        tasks["livebode"] = partial(library.frf_queued, tracker, *work, HOP)
        tasks["livebode push"] = partial(library.frf_pushed, tracker, *work, HOP)
        best = {name: t / length for name, t in side_by_side(tasks, seconds).items()}
        best["rls"] = min(best[name] for name in RLS)
        library.frf_free(tracker)
        records.append({"kind": "two channels, FRF every 20", "window": window, "bins": count, "seconds": best})
    return records
