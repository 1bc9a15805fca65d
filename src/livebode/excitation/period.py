"""The period of a recording, or the reason why it has none; periods that a shorter lag hides."""

from __future__ import annotations

from math import gcd

import numpy as np

from livebode.arrays import Floats
from livebode.core import ANY_EXCITATION, SignalError, fast_length
from livebode.excitation._extent import extent
from livebode.excitation.blocks import cut, grouped, spectra
from livebode.excitation.doubtful import with_lines_beside
from livebode.excitation.hum import without_mains
from livebode.excitation.prepare import clipped, whitened
from livebode.excitation.significance import FALSE_ALARM, find_lines

# The rounding of an FFT autocorrelation, with room; a line 60 dB below the rest is still 1e-6.
ROUNDING = 1e-10
LAG_MIN = 3  # samples: the shortest period with a line below the Nyquist frequency


def difference(x: Floats) -> Floats:
    """var(x(n) − x(n − l)) / (var x(n) + var x(n − l)) over the samples that overlap, shape (samples,), by lag l.

    0 where the recording repeats exactly, noise/(noise + signal) where it repeats with noise, 1 where it is
    uncorrelated. Variances about their means, so that an offset and a constant slope have no effect. From the
    autocorrelation by FFT (Wiener–Khinchin) and running sums: O(n log n), and without the bias of an autocorrelation
    that divides by the full length. Cf. de Cheveigné, Kawahara 2002 (YIN), eq. (7).
    """
    size = fast_length(2 * x.size)
    spectrum = np.fft.rfft(x, size)
    product = np.fft.irfft(spectrum.real**2 + spectrum.imag**2, size)[: x.size]
    del spectrum
    head, tail = _running(x)
    head2, tail2 = _running(x * x)
    overlap = np.arange(x.size, 0, -1)
    both = head2 + tail2 - (head**2 + tail**2) / overlap
    unlike = both - 2 * (product - head * tail / overlap)
    # Where a part is constant its variance is rounding, without information.
    clear = both > ROUNDING * max(float(both[0]), 0.0)
    return np.where(clear, unlike / np.where(clear, both, 1.0), 1.0)


def _running(x: Floats) -> tuple[Floats, Floats]:
    """Sums of the first n − l and of the last n − l samples, by l."""
    sums = np.concatenate(([0.0], np.cumsum(x)))
    return sums[:0:-1], sums[-1] - sums[:-1]


def best_lag(d: Floats, lag_max: int) -> tuple[int, int]:
    """The shortest lag that repeats as well as any up to `lag_max`, and the width of its valley in samples.

    Lags before the first dissimilarity (halfway from best to worst) are ignored: every slow signal is similar to itself
    a few samples later. Two lags repeat equally well where their differences are
    within what noise does to such a sum: a relative standard deviation of √(2/n) each (χ² with n samples), taken three
    times. Where the signal is smooth, a whole stretch of lags does; its deepest point is the candidate.
    """
    lags = d[: lag_max + 1]
    halfway = (float(lags[1:].max()) + float(lags[1:].min())) / 2
    first = max(LAG_MIN, int(np.argmax(lags >= halfway)))
    lags = lags[first:]
    best = float(lags.min())
    limit = max(best, 0.0) * (1 + 3 * 2 * np.sqrt(2 / (d.size - lag_max))) + ROUNDING
    good = lags <= max(limit, best)
    start = int(np.argmax(good))
    ends = np.flatnonzero(~good[start:])
    width = int(ends[0]) if ends.size else lags.size - start
    return first + start + int(np.argmin(lags[start : start + width])), width


_SURE_SIGMAS = 5.0
_OFF_MIN = 0.1  # samples: two clocks, one for the excitation and one for the recorder, differ by less
_TIMES_MAX = 8  # of a period that is not whole; more are rarely recorded twice
_PRECISE = 0.1  # samples: a multiple is whole if it is known as precisely as that


def longer_period(x: Floats, period: int, rate_hz: float, d: Floats) -> int:
    """The period of which `period` is a part at the strong lines only.

    A line of a tenth of the power may have no common factor with the others; then the recording repeats much better
    after a multiple, at which that line is found. A strong line may also repeat after a number of samples that is not
    whole, such as 166.67; then its phase drifts from one period to the next, and three periods are one window.

    Parameters
    ----------
    x
        Periodic part of the recording, shape (samples,).
    period
        The lag at which it repeats, samples.
    rate_hz
        Samples per second.
    d
        Its difference at each lag, `repetition.difference`.
    """
    multiple = _multiple(x, period, rate_hz, d)
    if multiple != period:
        return multiple
    whole = _whole_multiple(x, period)
    if 2 * whole > x.size:
        return period
    chance = 1 + _SURE_SIGMAS * 2 * np.sqrt(2 / (x.size - whole))
    return whole if d[whole] <= max(d[period], 0.0) * chance + ROUNDING else period


def _multiple(x: Floats, period: int, rate_hz: float, d: Floats) -> int:
    lags = np.arange(period, x.size // 2 + 1, period)
    if lags.size < 2:
        return period
    lag = int(lags[np.argmax(d[lags] <= 2 * max(float(d[lags].min()), 0.0) + ROUNDING)])
    if 2 * max(float(d[lag]), 0.0) + ROUNDING >= d[period]:
        return period
    classes = with_lines_beside(find_lines(spectra(cut(x, lag))), rate_hz / lag)
    lines = np.flatnonzero(classes.excited)
    common = gcd(lag, *map(int, lines))
    return lag // common if lines.size and lag // common > period else period


def _whole_multiple(x: Floats, period: int) -> int:
    """The nearest whole number of samples with a whole number of true periods; `period` if it is not known better."""
    off, deviation = period_error(x, period)
    if abs(off) < max(_OFF_MIN, _SURE_SIGMAS * deviation):
        return period
    for times in range(1, _TIMES_MAX + 1):
        length = times * (period + off)
        if _SURE_SIGMAS * times * deviation > 0.5 - _PRECISE:
            break
        if abs(length - round(length)) <= _PRECISE + 2 * times * deviation and round(length) >= LAG_MIN:
            return round(length)
    return period


def period_error(x: Floats, period: int) -> tuple[float, float]:
    """True period minus `period` in samples, and its standard deviation; (0, inf) if it cannot be determined.

    At line k the phase drifts by −2πk·error/period from one period to the next. Least squares over the lines, weighted
    by their powers, with the scatter of the residuals.

    Examples
    --------
    >>> x = np.cos(2 * np.pi * 3 * np.arange(1500) / 500)
    >>> round(period_error(x, 167)[0], 2)
    -0.33
    """
    periods = spectra(cut(x, period))
    lines = np.flatnonzero(find_lines(periods).excited)
    count = len(periods)
    if count < 3 or not lines.size:
        return 0.0, np.inf
    phase = np.unwrap(np.angle(periods[:, lines]), axis=0)
    phase -= phase.mean(axis=0)
    weight = np.abs(periods[:, lines].mean(axis=0)) ** 2
    number = (np.arange(count) - (count - 1) / 2)[:, np.newaxis]
    slope = -2 * np.pi * lines / period * number  # of the phase, per sample of error
    squares = float(np.sum(weight * slope**2))
    error = float(np.sum(weight * slope * phase)) / squares
    left = float(np.sum(weight * (phase - error * slope) ** 2)) / (lines.size * (count - 1) - 1)
    return error, float(np.sqrt(left / squares))


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
    overlap = flat.size - lag
    # Further below the best shorter lag than noise in the shorter overlap explains: F with (rest, rest) degrees.
    if d[lag] * (1 + _SIGMAS * 2 / np.sqrt(overlap)) > (d[period] if period else 1.0) or d[lag] > 0.5:
        return None
    # A multiple of the period, with an error of half a sample each, is not new.
    if period and abs(lag - period * round(lag / period)) <= min(1 + lag // (2 * period), period // 4):
        return None
    pair = np.concatenate((flat[:overlap], flat[lag:]))
    if log_chance(pair, overlap) + np.log(flat.size) > np.log(FALSE_ALARM):
        return None
    return SignalError(
        "too-short",
        f"the excitation seems to repeat after {lag} samples, but the recording has only "
        f"{flat.size / lag:.2f} periods ({flat.size} samples)",
        f"record at least two periods, or {ANY_EXCITATION}",
        samples=int(flat.size),
        period=lag,
    )
