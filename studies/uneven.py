"""Coverage of the bounds where every channel has a clock of its own that jitters.

`python -m studies.uneven [runs]` prints for each case the share of errors within the 1σ and 2σ bounds of a single
window, of an average and of the mean over a run, beside the targets.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode import Lines, Response, Responses, Settings, multisine
from livebode.estimation import UnevenTracker
from livebode.fitting import mean_response
from livebode.preparation import UnevenSource
from livebode.simulation import TwoMassLoop, TwoMassPlant
from livebode.simulation.two_mass_loop import RATE_HZ
from livebode.sources import Chunk, Column, DeclaredQuantities, Recording, UnevenLog
from studies.common import Floats

TARGET = (0.60, 0.95)
LINES = Lines.parse("20:110:10", RATE_HZ, 400)
PERIODS, NOISE = 60, 0.05  # rad/s


@dataclass(frozen=True)
class Case:
    """Rates of w, u and y, largest displacement of a sample in steps, periods in a window, and the estimator."""

    name: str
    jitter: float
    rates_hz: tuple[float, float, float] = (1000.0, 400.0, 250.0)
    periods: int = 3
    estimator: str = "joint"
    lost: float = 0.0  # share of the samples


CASES = (
    *(Case(f"jitter of {j:g} step, {e}", j, estimator=e) for e in ("joint", "direct") for j in (0.0, 0.1, 0.3, 0.5)),
    Case("jitter of 0.5 step, one rate", 0.5, (1000.0, 1000.0, 1000.0)),
    Case("jitter of 0.5 step, a tenth of the samples lost", 0.5, lost=0.1),
    Case("jitter of 0.5 step, hardly more samples than amplitudes", 0.5, periods=1),
)


class MemoryRecording(Recording):
    """Channels in memory by name, each with its times in seconds."""

    format: ClassVar[str] = "memory"

    def __init__(self, channels: Mapping[str, tuple[Floats, Floats]]) -> None:
        super().__init__(Path("memory"))
        self._parts = {
            f"{name}{end}": values
            for name, both in channels.items()
            for end, values in zip((".t", ""), both, strict=True)
        }
        self.columns = tuple(
            Column(name, "s" if name.endswith(".t") else "", values.size, group=name[0], clock=name.endswith(".t"))
            for name, values in self._parts.items()
        )

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        for first in range(0, columns[0].samples or 0, rows):
            yield [self._parts[column.name][first : first + rows] for column in columns]


def uneven_log(channels: Mapping[str, tuple[Floats, Floats]], rate_hz: float) -> UnevenLog:
    """A log of these channels, the first of which is the reference, on a grid of this rate."""
    return UnevenLog(MemoryRecording(channels), list(channels), rate_hz, None, 1 << 16, DeclaredQuantities(), None)


def ticks(rate_hz: float, jitter: float, lost: float, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Ticks of the loop at which a channel is sampled: each at most `jitter` steps from its place, none twice."""
    step = RATE_HZ / rate_hz
    places = np.arange(step / 2, count - step / 2, step)
    at = np.rint(places + rng.uniform(-jitter, jitter, places.size) * step)
    at = np.unique(np.clip(at, 0, count - 1).astype(np.int64))
    return at[rng.uniform(size=at.size) >= lost]


def recorded(case: Case, seed: int, periods: int = PERIODS) -> UnevenLog:
    """The two masses in closed loop, computed at every tick of 4 kHz; each channel is sampled at ticks of its own."""
    rng = np.random.default_rng(seed)
    period = multisine(LINES, phases="random", seed=seed)
    period *= 0.5 / np.std(period)
    u, y = TwoMassLoop().run(period, periods, NOISE, seed=seed)
    signals = {"w": np.tile(period, periods), "u": u[0], "y": y[0]}
    clocks = (ticks(rate, case.jitter, case.lost, periods * period.size, rng) for rate in case.rates_hz)
    return uneven_log({name: (at / RATE_HZ, signals[name][at]) for name, at in zip("wuy", clocks)}, case.rates_hz[0])


def ways(case: Case, log: UnevenLog) -> dict[str, Response]:
    """The newest single window, the mean over the run, and the newest average."""
    window = case.periods * 100
    lines = Lines.parse("20:110:10", 1000.0, window)
    settings = Settings(lines=lines, output="y", input="u", excitation="w", estimator=case.estimator, hop=window // 4)
    source = UnevenSource(log, settings, (), ())
    single = UnevenTracker(settings, source.layout)
    average = UnevenTracker(replace(settings, average=True, forgetting=1.0), source.layout)
    parts, last = [], None
    for block in source.blocks():
        parts.append(single.process(block))
        last = average.process(block)
    assert last is not None
    responses = Responses.join(parts)
    return {"single": responses[-1], "mean": mean_response(responses)[0], "average": last[-1]}


def measure(case: Case, runs: int, periods: int = PERIODS) -> dict[str, tuple[float, float]]:
    """Share of errors within the bounds of 1σ and 2σ, by way, at valid lines."""
    truth = TwoMassPlant().response(LINES.frequency_hz)
    hits: dict[str, list[Any]] = {}
    for seed in range(runs):
        for way, response in ways(case, recorded(case, seed, periods)).items():
            error = np.abs(response.value - truth)[response.valid]
            hits.setdefault(way, []).append(np.stack([error <= response.bound(c)[response.valid] for c in (1, 2)]))
    shares = {way: np.concatenate(rows, axis=1).mean(axis=1) for way, rows in hits.items()}
    return {way: (float(one), float(two)) for way, (one, two) in shares.items()}


def main(arguments: list[str]) -> int:
    runs = int(arguments[0]) if arguments else 100
    print(f"target: {TARGET[0]:.0%} within 1σ and {TARGET[1]:.0%} within 2σ; {runs} runs of {len(LINES)} lines each")
    missed = 0
    for case in CASES:
        found = measure(case, runs)
        met = all(c[0] >= TARGET[0] and c[1] >= TARGET[1] for c in found.values())
        missed += not met
        shares = ", ".join(f"{way} {c[0]:.1%}/{c[1]:.1%}" for way, c in found.items())
        print(f"{'met' if met else 'missed':6} {case.name}: {shares}", flush=True)
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
