"""From spectra at lines to frequency responses with their scatter, in C; `tests/twins/lines.py` defines it.

Numerator and denominator of an estimate are the spectra of the output and of another signal, each times
conj(reference). Windows one period apart are one series: every place in the period has moments of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebode.arrays import Complex, Flags, Floats, Integers
from livebode.kernel import _native

MEANS, SCATTER, CHANGES, PLACE = 10, 4, 5, 5
NOISE_SCATTER, NOISE_MOVING, NOISE_LARGER = range(3)
"""Noise from the scatter between periods; where the machine moves, from detection lines; also elsewhere, if larger."""


_SEVERAL = 1e-9  # Σv − Σv²/Σv is exactly 0 for one window, except for rounding


class WeightSums(NamedTuple):
    """Sums over the windows of each row, shape (rows,): Σλ^i, Σλ^2i, Σλ^3i, Σiλ^i, Σλ^i(i − μ)² and Σλ^2i(i − μ)², with
    μ the mean age Σiλ^i/Σλ^i."""

    one: Floats
    two: Floats
    three: Floats
    ages: Floats
    spread: Floats
    spread_two: Floats

    @classmethod
    def after(cls, count: Integers, forgetting: float, table: Floats) -> WeightSums:
        """Sums over so many windows, from their table (`LineSettings.weights`)."""
        if forgetting == 1:
            windows = count.astype(np.float64)
            ages, spread = 0.5 * windows * (windows - 1.0), windows * (windows * windows - 1.0) / 12.0
            return cls(windows, windows, windows, ages, spread, spread)
        return cls(*table[:, np.minimum(count, table.shape[1] - 1)])

    @property
    def unbiased(self) -> Floats:
        """Scatter over this is the variance of one window; NaN for fewer than two windows."""
        with np.errstate(invalid="ignore"):
            difference = self.one - self.two / self.one
            return np.where(difference > _SEVERAL, difference, np.nan)

    @property
    def of_mean(self) -> Floats:
        """Variance of the weighted mean over that of one window."""
        with np.errstate(invalid="ignore"):
            return self.two / (self.one * self.one)

    @property
    def dof(self) -> Floats:
        """Complex degrees of freedom of a scatter; NaN for fewer than two windows.

        Exactly m − 1 for m windows of equal weight; else matched in two moments, tr(M)²/tr(M²) with
        M = diag(v) − vvᵀ/Σv, v = λ^i (Satterthwaite 1946).
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            unbiased, ratio = self.unbiased, self.two / self.one
            return unbiased * unbiased / (self.two - 2 * self.three / self.one + ratio * ratio)


class LineMoments(NamedTuple):
    """Running moments, zeros before the first window; functions change them in place.

    Attributes
    ----------
    windows
        Number of windows that were added, shape (places,).
    means
        Means of the real and imaginary parts of numerator, denominator and reference (6) and of four powers (4), shape
        (10, places, lines). The powers are those of reference and output, of the noise at detection lines, and of
        the denominator's signal.
    scatter
        Σλ^i|δnum|², Σλ^i|δden|² and the real and imaginary part of Σλ^i·δnum·conj(δden) with δ the deviation from the
        mean, shape (4, places, lines).
    change
        Of the error e of a window, numerator − Ĝ·denominator: Σλ^i|step|² of its steps from one period to the next,
        real and imaginary part of Σλ^i(μ − i)·e, and those of the newest e, shape (5, places, lines).
    moment
        Means of time and schedule of the windows' centres, the oldest sample, and the numbers of lines with a trend and
        with more scatter than steps in the newest window, shape (5, places).
    """

    windows: Integers
    means: Floats
    scatter: Floats
    change: Floats
    moment: Floats


class LineSettings(NamedTuple):
    """What all windows have in common.

    Attributes
    ----------
    forgetting
        λ per period.
    weights
        `WeightSums` over 0, 1, 2 … windows, the last ones also for more, shape (6, any); ignored for λ = 1.
    averages
        Whether a value is that of all windows so far; otherwise it is that of one, whose scatter excludes it.
    denominator, reference
        Their places among the signals; the output is the first one.
    noise
        NOISE_SCATTER, NOISE_MOVING or NOISE_LARGER.
    noise_dof
        Degrees of freedom of the noise at detection lines.
    instruction_set
        Its number (`livebode.kernel._instructions`), which changes no bit; 0 for the widest of this machine.
    """

    forgetting: float
    weights: Floats
    averages: bool
    denominator: int
    reference: int
    noise: int
    noise_dof: float
    instruction_set: int


class LineWindows(NamedTuple):
    """Windows at consecutive places.

    Attributes
    ----------
    largest
        Largest power of the reference before them.
    place
        Of the first one in the period.
    spectrum
        Shape (signals, rows, bins); the lines are the first bins.
    noise
        Power at the detection lines as one of numerator·conj(reference), shape (rows, lines); None without.
    whole, clean, aside
        Windows without a gap; also without a spike; and those from which nothing is learned, shape (rows,).
    moving
        Windows in which the machine moves, shape (rows,); None if never.
    distortion, invalid
        Errors that repeat with the excitation, and lines that are invalid because of them, shape (verdicts, lines).
    verdict
        Number of the verdict that is that of the row, shape (rows,); None without.
    dof_repeating
        Degrees of freedom of `distortion`.
    moment
        Time, schedule and oldest sample, shape (3, rows).
    """

    largest: float
    place: int
    spectrum: Complex
    noise: Floats | None
    whole: Flags
    clean: Flags
    aside: Flags | None
    moving: Flags | None
    distortion: Floats | None
    invalid: Flags | None
    verdict: Integers | None
    dof_repeating: float
    moment: Floats


class MachineLines(NamedTuple):
    """What is known of one of several machines before its next window; the arrays are changed.

    Attributes
    ----------
    moments
        Its moments.
    sizes, limits
        Largest magnitudes of each signal's spectra in the period so far, and their limits, shape (signals,).
    ends
        Whether the window is the last one of the period.
    """

    moments: LineMoments
    sizes: Floats
    limits: Floats
    ends: bool


class NewestWindows(NamedTuple):
    """A window of each of several machines, without noise from detection lines or known errors.

    Attributes
    ----------
    largest, place
        As in `LineWindows`, of each machine, shape (machines,).
    sums
        Spectra of all signals at all bins, shape (all, machines, bins).
    chosen
        Numbers of the signals, shape (signals,), and of the lines among the bins, shape (lines,).
    moment
        Time, schedule and oldest sample, shape (machines, 3).
    due
        Windows that are whole, clean, and follow the machine's previous one, shape (machines,).
    """

    largest: Floats
    place: Integers
    sums: Complex
    chosen: tuple[Integers, Integers]
    moment: Floats
    due: Flags


class LineRows(NamedTuple):
    """Results: shape (rows, lines), of `dof` and `usable` (rows,), of `moment` (3, rows); NaN where not known.

    `sigma` is that of the value, `variation` the part of it from a change of the machine, `coherence` that of reference
    and output and `input_coherence` that of reference and denominator (NaN where they are one signal), `usable` tells
    which windows entered the moments.
    """

    value: Complex
    sigma: Floats
    coherence: Floats
    input_coherence: Floats
    weight: Complex
    distortion: Floats
    variation: Floats
    valid: Flags
    dof: Floats
    moment: Floats
    usable: Flags


def process_lines(settings: LineSettings, moments: LineMoments, windows: LineWindows) -> tuple[LineRows, float]:
    """Results of the windows, which are added to the moments, and the largest power of the reference so far."""
    rows = len(windows.whole)
    results = _rows(rows, moments.means.shape[2], (3, rows))
    return results, _native.process_lines(settings, moments, windows, results)


def process_newest(
    settings: LineSettings, machines: list[MachineLines], windows: NewestWindows, factor: float
) -> tuple[LineRows, Floats, Flags]:
    """One window of each of several machines with the same settings, where noise is NOISE_SCATTER.

    Returns rows of the machines whose window is due, finite and within its limits, with the bits of `process_lines` for
    each alone; largest powers, shape (machines,); and which machines these are, shape (machines,). Others have not
    changed. At the end of a period the limits become `factor` times its largest magnitudes, or infinite where these are
    0. Where an argument is refused, nothing has changed.
    """
    count, largest, taken = len(machines), windows.largest.copy(), windows.due.copy()
    results = _rows(count, len(windows.chosen[1]), (count, 3))
    _, place, sums, chosen, moment, _ = windows
    sums = np.ascontiguousarray(sums)
    rows = _native.process_newest(settings, machines, largest, place, sums, chosen, moment, factor, results, taken)
    if rows < count:
        results = LineRows._make(part[:rows] for part in results)
    return results._replace(moment=results.moment.T), largest, taken


def largest_magnitudes(spectrum: Complex) -> Floats:
    """Largest magnitude of each row, shape (signals, rows), of spectra (signals, rows, bins); NaN where one is NaN."""
    largest = np.empty(spectrum.shape[:2])
    _native.largest_magnitudes(spectrum, largest)
    return largest


def _rows(rows: int, lines: int, moment: tuple[int, int]) -> LineRows:
    shape = rows, lines
    return LineRows(
        np.empty(shape, np.complex128),
        np.empty(shape),
        np.empty(shape),
        np.empty(shape),
        np.empty(shape, np.complex128),
        np.empty(shape),
        np.empty(shape),
        np.empty(shape, np.bool_),
        np.empty(rows),
        np.empty(moment),
        np.empty(rows, np.bool_),
    )
