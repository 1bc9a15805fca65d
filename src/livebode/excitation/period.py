"""The period of a recording, or the reason why it has none; whether it is periodic or only appears to be."""

from __future__ import annotations

from math import gcd

import numpy as np

from livebode.arrays import Floats
from livebode.core import ANY_EXCITATION, SignalError
from livebode.excitation._extent import extent
from livebode.excitation.blocks import cut, grouped, spectra
from livebode.excitation.hum import without_mains
from livebode.excitation.longer import longer_period
from livebode.excitation.prepare import clipped, whitened
from livebode.excitation.repetition import LAG_MIN, ROUNDING, best_lag, difference
from livebode.excitation.significance import FALSE_ALARM, find_lines

# A resonance or a slow trajectory is similar from one period to the next, but not from one end of the recording to the
# other. So neighbouring periods are averaged to at most this many stretches, which are then compared.
_STRETCHES_MAX = 16


def log_chance(x: Floats, period: int) -> float:
    """Bound on ln of the probability that a recording without a period repeats as well as `x` does with this one.

    In each bin k of the period, with X_gk the spectra of G stretches, C = |Σ_g X_gk|²/(G·Σ_g|X_gk|²) is the share of
    power that repeats. Noise of any spectrum has P(C > c) = (1 − c)^(G − 1), whatever the power in the bin. The bins
    are ordered by their power, which is independent of C, and the 1, 2, 4, … strongest are combined; −ln of their
    probabilities add to a gamma distribution, whose tail Chernoff's inequality bounds. The result is the least of these
    times their number (Bonferroni).
    """
    groups = grouped(spectra(cut(x, period)), _STRETCHES_MAX)[:, 1:]
    count, bins = groups.shape
    if count < 2 or not bins:
        return 0.0
    total = np.sum(np.abs(groups) ** 2, axis=0)
    share = np.abs(groups.sum(axis=0)) ** 2 / (count * np.maximum(total, np.finfo(np.float64).tiny))
    # With rounding, a bin that repeats exactly has 1 − C = 1e-16 or 0.
    missing = np.clip(1 - share, np.finfo(np.float64).eps, 1.0)
    evidence = np.where(total > 0, -(count - 1) * np.log(missing), 0.0)
    sizes = 2 ** np.arange(int(np.log2(bins)) + 1)
    added = np.cumsum(evidence[np.argsort(total)[::-1]])[sizes - 1]
    added = np.maximum(added, sizes)
    return float(min(0.0, np.log(sizes.size) + np.min(sizes - added + sizes * np.log(added / sizes))))


# Largest number of neighbouring lags on either side that are tried. The autocorrelation of a slow signal is flat over
# more samples only where noise makes the period uncertain anyway.
_NEIGHBOURS_MAX = 16
# Change from period to period at the lines, beyond the noise: more than a tenth of their power is not a period.
_LEFT_OVER_MAX = 0.1
# Of the recording, or of the part above its background, at least a third must repeat (an SNR of −3 dB); otherwise one
# tone fits some lag by chance.
_DIFFERENT_MAX = 2 / 3
_SIGMAS = 4.0  # one in 3e4 by chance, and the lags near the best are few
_PART = 2**19  # samples; two minutes at 4 kHz


def find_period(x: Floats, rate_hz: float, step: float) -> tuple[int, int, int]:
    """Period in samples, first sample of the periodic part and the sample after its last.

    1. Use the recording unchanged, and whitened, for robustness against a trajectory and few periods. 2. For each, find
    the shortest lag with the least difference. 3. Among its neighbours, select the one whose periods add up to the most
    power. 4. The version with the stronger evidence decides; reject it if a recording without a period would reach this
    with a probability above 1e-3 for all lags and both versions together. 5. Divide by the common factor of all excited
    bins; multiply where that finds lines in between, or makes a fractional period whole. 6. Reject it if the lines
    change more than noise explains, or if the recording repeats better after more than its half. 7. Take the shortest
    divisor at whose harmonics all lines are, except mains hum and the error of rounding.

    Parameters
    ----------
    x
        Finite samples, shape (samples,).
    rate_hz
        Samples per second.
    step
        The samples are multiples of it; 0 for none.

    Notes
    -----
    Some recordings appear periodic but are not: a tone or an oscillation that decays more slowly than the recording
    lasts has the period of its best lag; a random drift is similar to itself, about once in forty recordings, after
    nearly half of its length. In noise of 0 dB, two or three periods may be rejected or give a period with an error of
    one sample.

    Raises
    ------
    SignalError
        If nothing repeats, or the recording has fewer than two periods.
    """
    if x.size < 2 * LAG_MIN:
        raise SignalError(
            "too-short",
            f"{x.size} samples are too few for two periods",
            "record at least two periods",
            samples=int(x.size),
        )
    calm = clipped(x)
    calm -= calm.mean()
    period = _fundamental_of(calm, rate_hz)
    start, stop = extent(calm, period)
    shorter = without_mains(calm[start:stop], period, rate_hz, step)
    if shorter < period:
        start, stop = extent(calm, shorter)
    return shorter, start, stop


def _fundamental_of(calm: Floats, rate_hz: float) -> int:
    # Most periods are short compared with a long recording; a part in its middle finds them as well in less time.
    if calm.size > _PART:
        middle = calm[calm.size // 2 - _PART // 2 :][:_PART]
        try:
            return _sharpened(calm, difference(calm), _fundamental_of(middle, rate_hz), 1)
        except SignalError:
            pass
    flat, peaks = whitened(calm)
    d = difference(calm)
    prominent = difference(peaks)
    views = [_judged(calm, d), _judged(flat, prominent)]
    needed = np.log(FALSE_ALARM) - np.log(calm.size)  # two views of half as many lags
    evidence, period, view = min(views, key=lambda v: v[0])
    # A shorter lag has more periods as evidence; the other is used where the recording repeats twice as well.
    if views[0][0] <= needed and 2 * d[views[0][1]] + ROUNDING < d[period]:
        evidence, period, view = views[0]
    fundamental = 0
    if evidence <= needed:
        start, stop = extent(view, period)
        fundamental = _fundamental(view[start:stop], period, (d, prominent))
        fundamental = longer_period(view[start:stop], fundamental, rate_hz, d)
    if short := _too_short(flat, d, fundamental):
        raise short
    repeats = min(d[fundamental], prominent[fundamental]) <= _DIFFERENT_MAX
    if fundamental and repeats and _steady_at_lines(view[start:stop], fundamental):
        return fundamental
    half = calm.size // 2
    raise SignalError(
        "not-periodic",
        f"the excitation does not repeat within {half} samples, half of the recording "
        f"(the best lag, {period} samples, leaves {min(100, 100 * max(d[period], 0)):.0f} "
        "% of its power different)",
        f"{ANY_EXCITATION}, or record at least two whole periods of a multisine, PRBS, square wave or repeated chirp",
        samples=int(calm.size),
        best_lag=period,
    )


def _judged(view: Floats, d: Floats) -> tuple[float, int, Floats]:
    lag, width = best_lag(d, view.size // 2)
    # The difference of samples one lag apart is the slope of a drift, without the periodic part.
    slope = float(np.mean(view[lag:] - view[:-lag])) / lag
    level = view - slope * (np.arange(view.size) - view.size / 2)
    period = _sharpened(level, d, lag, width)
    return log_chance(level, period), period, level


def _sharpened(flat: Floats, d: Floats, lag: int, width: int) -> int:
    """The neighbour of a lag whose periods add up to the most power at the excited bins.

    Only neighbours that repeat as well as the best of them, within what noise does to a difference: in a recording
    with little noise the difference is more precise.
    """
    reach = min(max(width, 2), _NEIGHBOURS_MAX)
    lines = _lines(flat, lag) or None
    tried = np.arange(max(lag - reach, LAG_MIN), min(lag + reach, flat.size // 2) + 1)
    limit = max(float(d[tried].min()), 0.0) * (1 + _SIGMAS * 2 * np.sqrt(2 / (flat.size - tried[-1]))) + ROUNDING
    tried = tried[d[tried] <= limit]
    # A line of few cycles would leak into its image at a period that is not whole in the recording.
    tapered = flat * np.hanning(flat.size)

    def power(period: int) -> float:
        folded = np.pad(tapered, (0, -flat.size % period)).reshape(-1, period).sum(axis=0)
        bins = np.fft.rfft(folded)[1 : (period + 1) // 2]
        if lines:
            bins = bins[[k - 1 for k in lines if k <= bins.size]]
        return float(np.sum(np.abs(bins) ** 2))

    return int(max(tried, key=lambda p: (power(p), -abs(p - lag))))


def _lines(flat: Floats, period: int) -> list[int]:
    if flat.size < 2 * period:
        return []
    return [int(k) for k in np.flatnonzero(find_lines(spectra(cut(flat, period))).excited)]


def _fundamental(flat: Floats, period: int, differences: tuple[Floats, ...]) -> int:
    lines = _lines(flat, period)
    common = gcd(period, *lines) if lines else 1
    # Two periods may be too few to detect the one line that has no common factor with the others; then the shorter lag
    # differs more, by that line. Up to twice is allowed: it has other samples of a transient and of the noise.
    if any(d[period // common] <= 2 * max(d[period], 0.0) + ROUNDING for d in differences):
        period //= common
    for factor in (2, 3):
        while (
            flat.size >= 2 * factor * period and gcd(factor, *(lines := _lines(flat, factor * period))) == 1 and lines
        ):
            period *= factor
    return period


def _steady_at_lines(view: Floats, period: int) -> bool:
    """Whether noise explains the change at the lines from one period to the next.

    Tones without a common period nearly agree at some lag, and noise cannot explain the rest at them. The change
    is the median over pairs of neighbouring periods, which a transient or a pause does not affect; the noise is that of
    the bin in the middle, with the effect of chance on a sum over this number of lines and pairs.
    """
    periods = spectra(cut(view, period))
    lines = find_lines(periods).excited
    if not lines.any():
        return True
    change = np.median(np.abs(np.diff(periods, axis=0)) ** 2, axis=0) / 2
    count, noise = int(lines.sum()), float(np.median(change[1:]))
    chance = _SIGMAS * noise * np.sqrt(2 * count * (1 + 1 / (len(periods) - 1)))
    power = float(np.sum(np.abs(np.mean(periods[:, lines], axis=0)) ** 2))
    return bool(change[lines].sum() - count * noise <= _LEFT_OVER_MAX * power + chance)


def _too_short(flat: Floats, d: Floats, period: int) -> SignalError | None:
    """For a recording that repeats after more than its half, better than with the period; else None."""
    half, longest = (
        flat.size // 2,
        flat.size - max(flat.size // 10, LAG_MIN),
    )  # a tenth must repeat, otherwise it is chance
    if longest <= half + 1:
        return None
    lag = half + 1 + int(np.argmin(d[half + 1 : longest]))
    rest = flat.size - lag
    # Further below the best shorter lag than noise in the shorter overlap explains: F with (rest, rest) degrees.
    if d[lag] * (1 + _SIGMAS * 2 / np.sqrt(rest)) > (d[period] if period else 1.0) or d[lag] > 0.5:
        return None
    # A multiple of the period, with an error of half a sample each, is not new.
    if period and abs(lag - period * round(lag / period)) <= min(1 + lag // (2 * period), period // 4):
        return None
    pair = np.concatenate((flat[:rest], flat[lag:]))
    if log_chance(pair, rest) + np.log(flat.size) > np.log(FALSE_ALARM):
        return None
    return SignalError(
        "too-short",
        f"the excitation seems to repeat after {lag} samples, but the recording has only "
        f"{flat.size / lag:.2f} periods ({flat.size} samples)",
        f"record at least two periods, or {ANY_EXCITATION}",
        samples=int(flat.size),
        period=lag,
    )
