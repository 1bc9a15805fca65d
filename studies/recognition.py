"""Share of generated multisines whose period and lines `recognise` finds exactly.

The recordings are quantised to 8 … 16 bits, rounded or truncated to decimals, with mains hum, with noise, or exact. Run
`python -m studies.recognition --cases 1000`; it prints a table and each recording whose lines were not found.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import dataclass
from math import gcd

import numpy as np
from numpy.typing import NDArray

from livebode.core import LivebodeError
from livebode.excitation import recognise

RATE_HZ = 4000.0
KINDS = ("exact", "bits", "rounded", "truncated", "bits and hum", "noise")
PROMISED = KINDS[:-1]  # without noise, 99 % are promised
RESULTS = ("exact", "cannot tell", "other lines", "another period", "rejected")
WRONG = RESULTS[2:4]
_PERIODS = (100, 128, 200, 400, 500, 1000, 1024, 2000, 4096)
_COUNTS = (1, 2, 5, 10, 20, 63, 100, 200)


@dataclass(frozen=True, eq=False)
class Recording:
    """A generated excitation with its shortest period and the bins of its lines."""

    samples: NDArray[np.float64]
    period: int
    bins: tuple[int, ...]
    kind: str
    words: str


def generate(seed: int) -> Recording:
    """A multisine of random length, lines, slope of the amplitudes, phases and size, recorded in one of `KINDS`."""
    rng = np.random.default_rng(seed)
    period = int(rng.choice(_PERIODS))
    bins = _bins(rng, period)
    slope_db = float(rng.choice([0, 0, 10, 20]))
    amplitude = 10 ** (-slope_db / 20 * np.linspace(0, 1, bins.size))
    schroeder = -np.pi * np.arange(bins.size) ** 2 / bins.size
    phase = rng.uniform(0, 2 * np.pi, bins.size) if rng.random() < 0.6 else schroeder
    spectrum = np.zeros(period // 2 + 1, dtype=np.complex128)
    spectrum[bins] = amplitude * np.exp(1j * phase)
    x = np.fft.irfft(spectrum, period)
    periods = int(rng.choice([3, 5, 10, 20]))
    x = np.tile(x * 10 ** rng.uniform(-1, 1.5) / np.abs(x).max(), periods)
    kind = str(rng.choice(KINDS))
    common = gcd(period, *map(int, bins))
    words = f"{kind}, {bins.size} lines over {slope_db:g} dB, {periods} periods of {period}"
    return Recording(_recorded(rng, x, kind), period // common, tuple(int(k) // common for k in bins), kind, words)


def _bins(rng: np.random.Generator, period: int) -> NDArray[np.int64]:
    count = min(int(rng.choice(_COUNTS)), period // 2 - 2)
    k = np.arange(1, count + 1)
    random = rng.choice(np.arange(1, period // 2), count, replace=False)
    bins = [k, 2 * k - 1, k * int(rng.integers(1, 5)), random][int(rng.integers(4))]
    return np.unique(bins[2 * bins < period])


def _recorded(rng: np.random.Generator, x: NDArray[np.float64], kind: str) -> NDArray[np.float64]:
    peak = float(np.abs(x).max())
    if "hum" in kind:
        t = np.arange(x.size) / RATE_HZ
        level, mains_hz = peak * 10 ** rng.uniform(-4, -2), 50 * (1 + 1e-4 * rng.standard_normal())
        for order in (1, 3):
            x = x + level / order * np.cos(2 * np.pi * order * mains_hz * t + rng.uniform(0, 2 * np.pi))
    if "bits" in kind:
        step = 2.1 * peak / 2.0 ** int(rng.integers(8, 17)) / rng.uniform(0.3, 1)
        return np.asarray(step * np.round(x / step))
    if kind in ("rounded", "truncated"):
        step = min(10.0 ** -int(rng.integers(1, 6)), 10.0 ** np.floor(np.log10(peak / 100)))  # 100 steps or more
        return np.asarray(step * (np.round if kind == "rounded" else np.trunc)(x / step))
    if kind == "noise":
        return np.asarray(x + peak * 10 ** rng.uniform(-4, -1.5) * rng.standard_normal(x.size))
    return x


def verdict(recording: Recording) -> str:
    """exact, another period, other lines, cannot tell, or rejected."""
    try:
        found = recognise(recording.samples, RATE_HZ)
    except LivebodeError as error:
        return "cannot tell" if error.code == "signal.lines-ambiguous" else "rejected"
    if found.period != recording.period:
        return "another period"
    return "exact" if found.lines.bins == recording.bins else "other lines"


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--cases", type=int, default=1000)
    arguments.add_argument("--seed", type=int, default=0)
    given = arguments.parse_args()
    counts: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}
    for seed in range(given.seed, given.seed + given.cases):
        recording = generate(seed)
        result = verdict(recording)
        counts[recording.kind][result] += 1
        if result != "exact":
            print(f"seed {seed}: {result}: {recording.words}")
    print("\n| recording | number | " + " | ".join(RESULTS) + " |\n|---|---" + "|---" * len(RESULTS) + "|")
    for kind, count in counts.items():
        print(f"| {kind} | {count.total()} | " + " | ".join(str(count[result]) for result in RESULTS) + " |")
    promised = sum((counts[kind] for kind in PROMISED), Counter[str]())
    share, wrong = (sum(promised[result] for result in of) / promised.total() for of in (RESULTS[:1], WRONG))
    print(f"\nwithout noise: {100 * share:.2f} % exact; target 99 %: {'met' if share >= 0.99 else 'missed'}")
    print(f"without noise: {100 * wrong:.2f} % wrong; target 0.2 %: {'met' if wrong <= 0.002 else 'missed'}")


if __name__ == "__main__":
    main()
