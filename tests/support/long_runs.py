"""Runs of many segments, recorded with an accelerated clock: responses of white noise with a known plant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Lines, Responses
from livebode.records import RESPONSES, SegmentLimits, Store, Thinning, as_batch

RATE_HZ, WINDOW, HOP = 40.0, 40, 10
LINES = Lines((3, 5, 8), WINDOW, RATE_HZ, ())
PLANT, NOISE, DOF = 2 - 1j, 0.3, 8.0
FOUND: dict[str, Any] = {
    "bins": list(LINES.bins), "window": WINDOW, "rate_hz": RATE_HZ, "quiet_bins": [], "hop": HOP,
    "quantity": "plant", "unit": "",
}  # fmt: skip


def noisy_responses(seconds: float, seed: int) -> Responses:
    """Windows that overlap by three quarters and share the noise of their common samples."""
    rng = np.random.default_rng(seed)
    samples = round(seconds * RATE_HZ)
    noise = rng.standard_normal((samples + 1, len(LINES), 2)).view(np.complex128)[..., 0] * np.sqrt(WINDOW / 2)
    noise[0] = 0
    sums = np.cumsum(noise, axis=0)
    stop = np.arange(WINDOW, samples + 1, HOP)
    value = PLANT + NOISE * (sums[stop] - sums[stop - WINDOW]) / WINDOW
    sigma = NOISE * np.sqrt(rng.gamma(DOF, 1 / DOF, value.shape))
    return Responses(
        lines=LINES, value=value, sigma=sigma, dof=np.full(len(stop), DOF), coherence=np.full(value.shape, 0.9),
        valid=np.ones(value.shape, dtype=bool), first=stop - WINDOW, sample=stop - 1,
        time_s=(stop - WINDOW / 2) / RATE_HZ, schedule=np.zeros(len(stop)), quantity="plant", unit="",
    )  # fmt: skip


def record_long(run: Path, segment_s: float, responses: Responses, *, finished: bool = True) -> None:
    """Record these responses from where the record ends, in segments of this length."""
    segment = round(segment_s * RATE_HZ)
    summary = {"configuration": {}, "found": FOUND}
    with Store(run, {"responses": RESPONSES}, SegmentLimits(1, segment), tiers=Thinning(FOUND).tables) as store:
        if store.last is None:
            store.begin(summary, 0, 0.0, {})
        assert store.last is not None
        end = int(responses.sample[-1]) + 1
        for begin in range(store.last.sample, end, segment):
            stop = min(begin + segment, end)
            use = np.flatnonzero((responses.sample >= begin) & (responses.sample < stop))
            if use.size:
                store.write("responses", as_batch(responses[use]))
            store.commit(stop, stop / RATE_HZ, {})
        store.finish(summary, {}, finished=finished)
