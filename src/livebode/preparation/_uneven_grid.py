"""The common grid of a recording with uneven clocks, and the lines of its excitation."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, gcd

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.configuration import Axis
from livebode.core import Lines, SignalError, spacing_hz
from livebode.estimation import UnevenSpectra, nearest_hop
from livebode.preparation.part import chosen_part
from livebode.preparation.plan import SEARCHED, auto_reference, beginning
from livebode.preparation.uneven_segments import segments
from livebode.sources import UnevenLog, exact_rate_hz, part_limit

_BLOCKS = 16
_BLOCK_BINS_MAX = 1024
_BLOCK_SAMPLES_PER_UNKNOWN = 3
_INFLATION_MAX = 10.0
_RUNS = 0.5  # of the usual power: less is a block in which the excitation does not run


def excited_lines(log: UnevenLog, name: str, window: int) -> Lines:
    """The lines of a channel that repeats every `window` samples of the grid, in its shortest period.

    All bins are fitted together to the samples of several periods, at their times: what is between the lines does not
    leak into them, and blocks of periods differ by noise only.

    Raises
    ------
    SignalError
        If there are less than two periods, or no line exceeds the noise.
    """
    from livebode.excitation import find_lines  # slow to import

    spectra = _block_spectra(log, name, window)
    power = np.sum(np.abs(spectra) ** 2, axis=1)
    spectra = spectra[power >= _RUNS * np.median(power)]
    bins = [int(k) for k in np.flatnonzero(find_lines(spectra).excited)] if len(spectra) > 1 else []
    if not bins:
        raise SignalError(
            "no-line-above-noise",
            f"no line of the period of {window} samples exceeds the noise of {len(spectra)} parts of {name!r}",
            "record more periods, or raise the amplitude",
            period=window,
        )
    common = gcd(window, *bins)
    if common > 1:  # a shorter period has more samples for each bin, so that higher ones can be seen
        return excited_lines(log, name, window // common)
    return Lines.of_bins(bins, window, log.rate_hz)


def _block_spectra(log: UnevenLog, name: str, window: int) -> Complex:
    """Amplitudes at the bins in each of up to 16 parts of the recording, shape (parts, bins)."""
    periods = log.samples // window
    blocks = min(_BLOCKS, periods)
    if blocks < 2:
        raise SignalError(
            "too-short",
            f"the recording has {log.samples} samples of the grid of {log.rate_hz:.6g} Hz, less than two periods of "
            f"{window}",
            "record at least two periods",
            samples=log.samples,
            window=window,
        )
    many = periods // blocks
    first = -(-log.first // window)
    expected = log.clocks([name])[0].stamps.rate_hz * window / log.rate_hz
    most = max(1, min(_BLOCK_BINS_MAX, (window - 1) // 2, int(expected * many / (2 * _BLOCK_SAMPLES_PER_UNKNOWN))))
    # Whole windows from the first one on, `many` in each part.
    parts = list(segments(log, [name], first, first + (periods - 1) // many * many, window))
    joined = [parts[i : i + many] for i in range(0, len(parts) - many + 1, many)]
    found = np.zeros((len(joined), most + 1), dtype=np.complex128)
    while most:
        fit = UnevenSpectra(tuple(range(1, most + 1)), (), window, 1, expected * many, [False])
        windows = [
            fit.window(
                fit.segment(
                    np.concatenate([at for at, _ in part]) / window, np.concatenate([x for _, x in part], axis=1)
                )[np.newaxis]
            )
            for part in joined
        ]
        if np.median([one.inflation.max() for one in windows]) < _INFLATION_MAX:
            whole = [i for i, one in enumerate(windows) if np.isfinite(one.inflation).all()]
            found = found[: len(whole), : most + 1]
            found[:, 1:] = [windows[i].sums[0] * (2 / window) for i in whole]
            return found
        most //= 2
    return found[:0]


_PIECE = 1 << 20  # complex numbers at a time
_PERIODS_MAX = 256  # for a measured period
_SAMPLES_PER_UNKNOWN = 3  # of a channel in a window, for each amplitude: their variance is then that of even samples
_WINDOWS_MIN = 8  # that a recording should have
_NEAR = 0.1  # relative difference of the rate of the grid and the median one
PLACES = 20  # windows in a period that a default hop should allow
_BINS_MAX = 4096
_STRONG = 0.1  # of the power that repeats at the strongest bin
_REPEATING = 0.5
_SNAPPED = 1e-3
"""Relative difference of a measured period and of that of the specified lines, at which these are meant."""


def uneven_grid(axis: Axis, log: UnevenLog) -> tuple[UnevenLog, Lines]:
    """The recording on a grid in which the period of the excitation has a whole number of samples, and the lines.

    The rate of the grid is the given one; else one with which the specified lines are on the grid of the window; else
    the one that the measured period of the excitation needs, near the median rate of the reference.

    Raises
    ------
    LivebodeError
        If there is no such grid, or nothing repeats.
    """
    frequencies, window = axis.lines.frequencies, axis.lines.window
    part, given = _fixed_part(axis, log), axis.source.rate_hz is not None
    spacing = None if frequencies == "auto" else spacing_hz(frequencies)
    if window == "auto":
        window, rate_hz = measured_grid(part, auto_reference(axis), spacing, given=given)
    elif spacing is not None:
        rate_hz = log.rate_hz if given else _rate_of(spacing, log.rate_hz, window)
    else:
        rate_hz = log.rate_hz if given else window / refined_period(part, auto_reference(axis), window / log.rate_hz)[0]
    grid = log.at_rate(rate_hz)
    lines = _lines(axis, grid, window)
    return grid, lines if axis.lines.window != "auto" else _longer(axis, grid, lines)


def _lines(axis: Axis, grid: UnevenLog, window: int) -> Lines:
    if axis.lines.frequencies != "auto":
        return Lines.parse(axis.lines.frequencies, grid.rate_hz, window)
    lines = excited_lines(_fixed_part(axis, grid), auto_reference(axis), window)
    many = 1 if axis.lines.window == "auto" else window // lines.window
    return Lines.of_bins([many * k for k in lines.bins], many * lines.window, grid.rate_hz)


def _longer(axis: Axis, grid: UnevenLog, lines: Lines) -> Lines:
    """The lines in a window of several periods, if the slowest channel has too few samples in one."""
    signals = axis.signals
    names = [name for name in (signals.output, signals.input, signals.excitation) if name]
    # Steps that vary cluster the samples, of which windows then have more or fewer.
    slowest_hz = min(one.stamps.rate_hz / (1 + one.stamps.jitter**2) for one in grid.clocks(names))
    needed = _SAMPLES_PER_UNKNOWN * (2 * len(lines) + 1)
    many = ceil(needed * grid.rate_hz / (slowest_hz * lines.window) - 1e-9)
    most = grid.samples // (_WINDOWS_MIN * lines.window)
    if many < 2 or most < 2:
        return lines
    many = min(many, most)
    return Lines.of_bins([many * k for k in lines.bins], many * lines.window, lines.rate_hz)


def _fixed_part(axis: Axis, log: UnevenLog) -> UnevenLog:
    """The part in [source] as far as its limits do not count periods."""
    limits = [axis.source.from_, axis.source.to]
    begin, end = (None if one is None or part_limit(one).unit == "periods" else one for one in limits)
    part = chosen_part(log, begin, end, 0, lambda part: (part.first, 1))
    assert isinstance(part, UnevenLog)
    return part


def measured_grid(
    log: UnevenLog, name: str, spacing: Fraction | None = None, *, given: bool = False
) -> tuple[int, float]:
    """Window and rate of a grid for the measured period of a channel.

    Parameters
    ----------
    log, name
        The recording and the channel.
    spacing
        Frequency of which all specified lines are multiples, Hz.
    given
        Whether the rate of the log is given, so that it must remain.
    """
    period_s, sigma_s = refined_period(log, name, _rough_period(log, name))
    period_s = 1 / exact_rate_hz(period_s, 3 * sigma_s / period_s)
    if spacing is not None and (many := round(period_s * spacing)):
        meant_s = float(many / spacing)
        period_s = meant_s if abs(period_s / meant_s - 1) < _SNAPPED else period_s
    if given:
        return round(period_s * log.rate_hz), log.rate_hz
    window = _divisible(max(4, round(period_s * log.rate_hz)))
    return window, exact_rate_hz(period_s / window, 1e-12)


def _rough_period(log: UnevenLog, name: str) -> float:
    """The period of a channel in seconds, to about a sample, from interpolated samples.

    Interpolation loses the highest lines where steps are long; means of two or four samples show the others better.
    """
    from livebode.excitation import (
        checked,
        filled,
        find_period,  # slow to import
    )

    samples = filled(checked(beginning(log, name), repr(name)))
    failed: SignalError | None = None
    for many in (1, 2, 4):
        means = samples[: samples.size // many * many].reshape(-1, many).mean(axis=1)
        try:
            return find_period(means, log.rate_hz / many, 0.0)[0] * many / log.rate_hz
        except SignalError as error:
            failed = failed or error
    assert failed is not None
    raise failed


def _divisible(window: int) -> int:
    """The nearest number of samples that a default hop divides."""
    for away in range(window):
        for tried in (window + away, window - away):
            hop = nearest_hop(tried, tried / PLACES)
            if tried >= 3 and tried % hop == 0 and hop <= 2 * max(1, tried // PLACES):
                return tried
    return window


def _rate_of(spacing: Fraction, near_hz: float, window: int) -> float:
    """The rate near the median one at which multiples of a frequency are lines of the window; else the median one."""
    many = round(window * spacing / Fraction(near_hz))
    if not many:
        return near_hz
    rate_hz = float(window * spacing / many)
    return rate_hz if abs(rate_hz / near_hz - 1) < _NEAR else near_hz


def refined_period(log: UnevenLog, name: str, period_s: float) -> tuple[float, float]:
    """The period of a channel near this one and its standard deviation, seconds, at the times of its samples.

    The phases of the strong bins advance from window to window by 2πk times the relative error of the period; windows
    further and further apart make this more precise.
    """
    spectra = _plain_spectra(log, name, period_s)
    k = np.arange(1, spectra.shape[1] + 1)
    error, sigma, apart = 0.0, 1.0, 1
    while apart < len(spectra):
        turned = np.exp(2j * np.pi * k * apart * error)
        pairs = spectra[:-apart].conj() * spectra[apart:]
        repeats = pairs.sum(axis=0) * turned
        power = (np.abs(spectra) ** 2).mean(axis=0) * len(pairs)
        strong = (np.abs(repeats) > _REPEATING * power) & (np.abs(repeats) > _STRONG * np.abs(repeats).max())
        if not strong.any():
            break
        weight, order = np.abs(repeats[strong]), k[strong]
        advance = np.angle(repeats[strong])
        total = 2 * np.pi * apart * np.sum(weight * order**2)
        error -= float(np.sum(weight * order * advance) / total)
        each = np.angle(pairs[:, strong] * turned[strong]) - advance
        sigma = float(np.sqrt(np.sum(weight**2 * order**2 * (each**2).mean(axis=0) / len(pairs))) / total)
        apart *= 2
    return period_s * (1 + error), period_s * sigma


def _plain_spectra(log: UnevenLog, name: str, period_s: float) -> Complex:
    """Means of x·e^(−j2πkt/T) over each of the first periods, shape (periods, bins)."""
    clock = log.clocks([name])[0].stamps
    bins = min(_BINS_MAX, max(1, int(period_s / clock.step_s / 2)))
    begin_s, held = log.first / log.rate_hz, (np.zeros(0), np.zeros(0))
    periods: list[Complex] = []
    most = max(2, min(_PERIODS_MAX, int(SEARCHED * clock.step_s / period_s)))
    stop_s = min(log.stop / log.rate_hz, begin_s + most * period_s)
    for time_s, data in log.pieces([name]):
        use = np.isfinite(data[0]) & (time_s >= begin_s) & (time_s < stop_s)
        held = np.concatenate([held[0], time_s[use]]), np.concatenate([held[1], data[0][use]])
        whole = int((time_s[-1] - begin_s) / period_s)
        while len(periods) < min(whole, most):
            end_s = begin_s + (len(periods) + 1) * period_s
            count = int(np.searchsorted(held[0], end_s))
            turns, x = (held[0][:count] - begin_s) / period_s, held[1][:count]
            periods.append(_means(turns, x, bins))
            held = held[0][count:], held[1][count:]
        if time_s[-1] >= stop_s:
            break
    return np.array(periods) if periods else np.zeros((0, bins), dtype=np.complex128)


def _means(turns: Floats, x: Floats, bins: int) -> Complex:
    found = np.zeros(bins, dtype=np.complex128)
    x = x - x.mean() if x.size else x
    size = max(1, _PIECE // bins)
    for i in range(0, x.size, size):
        powers = np.exp(-2j * np.pi * np.outer(turns[i : i + size] % 1.0, np.arange(1, bins + 1)))
        found += x[i : i + size] @ powers
    return found / max(x.size, 1)
