"""Lines that a measurement lacks, joined with those that it has on one grid."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from math import ceil, floor

from livebode.core import Lines
from livebode.dataclass import dataclass

_DECIMALS_MAX = 9


@dataclass(frozen=True)
class MissingLines:
    """Spans of missing lines, and all lines of the next measurement as `livebode design` takes them.

    Parameters
    ----------
    spans
        The missing lines, each as `start:stop:step` in Hz.
    lines
        Missing and existing lines together, in the form of `[lines]`: in Hz, or in bins of `window`.
    window
        The window for lines in bins, samples; None for lines in Hz.
    """

    spans: tuple[str, ...]
    lines: str
    window: int | None

    @classmethod
    def of(cls, lines: Lines, required: list[tuple[float, float, float]]) -> MissingLines:
        """For existing lines, and for each span its ends and the largest step, Hz.

        A step is a multiple of the resolution, or the resolution halved until it is small enough. So the existing lines
        are on the new grid, whose window is whole.
        """
        finer = max(_halvings(lines.resolution_hz, step) for _, _, step in required)
        window = lines.window << finer
        resolution_hz = Fraction(lines.rate_hz) / window
        nyquist = (window - 1) // 2
        bins = {k << finer for k in lines.bins}
        spans = []
        for low, high, wanted in required:
            step = (1 << finer) >> _halvings(lines.resolution_hz, wanted)
            step *= max(1, floor(Fraction(wanted) / (step * resolution_hz)))
            first = max(1, floor(Fraction(low) / (step * resolution_hz))) * step
            last = min(ceil(Fraction(high) / (step * resolution_hz)), nyquist // step) * step
            added = range(first, last + 1, step)
            spans.append(":".join(f"{float(k * resolution_hz):.6g}" for k in (first, last, step)))
            bins.update(added)
        return cls(tuple(spans), *_text(sorted(bins), window, lines.rate_hz))

    @property
    def remedy(self) -> str:
        """What to do, with the command."""
        window = "" if self.window is None else f" --window {self.window}"
        spans = ", ".join(self.spans)
        return f"add the lines {spans} Hz: livebode design EXPERIMENT.toml --lines '{self.lines}'{window}"


def _halvings(resolution_hz: float, wanted_hz: float) -> int:
    """How often the resolution is halved until it is no more than what is wanted."""
    return max(0, ceil(Fraction(resolution_hz) / Fraction(wanted_hz)) - 1).bit_length()


def _text(bins: list[int], window: int, rate_hz: float) -> tuple[str, int | None]:
    """In Hz if that is exact and short, else in bins of a window; in both no line is next to another."""
    resolution_hz = Fraction(rate_hz) / window
    if (10**_DECIMALS_MAX * resolution_hz).denominator == 1:
        return ", ".join(_run(run, resolution_hz) for run in _runs(bins)), None
    if any(b - a == 1 for a, b in pairwise(bins)):
        bins, window = [2 * k for k in bins], 2 * window
    return ", ".join(f"k={_run(run, Fraction(1))}" for run in _runs(bins)), window


def _runs(bins: list[int]) -> list[range]:
    """The bins as runs with equal steps, each as long as it can be."""
    runs: list[range] = []
    position = 0
    while position < len(bins):
        step = bins[position + 1] - bins[position] if position + 1 < len(bins) else 1
        end = position + 1
        while end < len(bins) and bins[end] - bins[end - 1] == step:
            end += 1
        runs.append(range(bins[position], bins[end - 1] + 1, step))
        position = end
    return runs


def _run(run: range, unit: Fraction) -> str:
    numbers = (run[0],) if len(run) == 1 else (run[0], run[-1], run.step)
    return ":".join(_decimal(k * unit) for k in numbers)


def _decimal(value: Fraction) -> str:
    """All digits of a number that has at most nine after its point."""
    return f"{Decimal(int(value * 10**_DECIMALS_MAX)).scaleb(-_DECIMALS_MAX).normalize():f}"
