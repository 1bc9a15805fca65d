"""One sample from Python, compared with an empty call; driven by map, so that no loop hides the difference."""

from collections import deque
from collections.abc import Callable
from typing import Any

from bench import native_build
from bench.work import CELLS, side_by_side
from livebode.kernel import SlidingDFT

SAMPLES = [0.25] * 10_000


def _driver(push: Callable[[float], None]) -> Callable[[], object]:
    return lambda: deque(map(push, SAMPLES), maxlen=0)


def measure(seconds: float) -> list[dict[str, Any]]:
    records = []
    for window, bins in CELLS:
        nothing, dft = native_build.empty().Nothing(), SlidingDFT(window, bins)
        best = side_by_side({"empty call": _driver(nothing.push), "livebode": _driver(dft.push)}, seconds)
        per_sample = {name: t / len(SAMPLES) for name, t in best.items()}
        records.append({"kind": "push", "window": window, "bins": len(bins), "seconds": per_sample})
    return records
