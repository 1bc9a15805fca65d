"""The NumPy twin of the line stage: the readable definition of what `process_lines` computes in C.

The same operations in the same order for each line, so C must agree with it to the bit (except for the sign and
payload of NaN). Products of complex numbers are written out, because NumPy's round otherwise in the last elements of an
array, and a sum over lines does not occur. `distortion`, `noise` and `invalid` come from other stages.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from livebode.kernel import (
    CHANGES,
    MEANS,
    NOISE_LARGER,
    NOISE_SCATTER,
    LineMoments,
    LineRows,
    LineSettings,
    LineWindows,
    MachineLines,
    NewestWindows,
    WeightSums,
)

Floats = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Flags = npt.NDArray[np.bool_]
Integers = npt.NDArray[np.int64]

_EXCITED = 1e-12  # of the largest power so far: above the rounding of the DFT, below any intended excitation
_NOISE = 8  # of the means: the power of the noise at detection lines
_LOG_RARE, _LOG_USUAL = 9.210340371976184, 1.3862943611198906  # of 10,000 and 4
_LINEAR, _ERRATIC = 0.09989410140273, 1.3
_TRENDS, _SCATTERS = 3, 4  # of the moments of a place: lines with a trend, and with more scatter than steps
_Part = tuple[slice, slice, bool]


class MomentRows(NamedTuple):
    """Windows so far (rows,), means (10, rows, lines) and scatter (4, rows, lines) after each window."""

    windows: Integers
    means: Floats
    scatter: Floats


def process_lines(settings: LineSettings, moments: LineMoments, windows: LineWindows) -> tuple[LineRows, float]:
    """Results of the windows, which are added to the moments, and the largest power of the reference so far."""
    with np.errstate(all="ignore"):
        return _process(settings, moments, windows)


def process_newest(
    settings: LineSettings, machines: list[MachineLines], windows: NewestWindows, factor: float
) -> tuple[LineRows, Floats, Flags]:
    """One window of each of several machines with the same settings; rows of those that take it."""
    yes, found, largest, taken = np.ones(1, dtype=np.bool_), [], windows.largest.copy(), windows.due.copy()
    signals, columns = windows.chosen
    for i, own in enumerate(machines):
        spectrum = np.ascontiguousarray(windows.sums[signals, i : i + 1][:, :, columns])
        sizes = np.hypot(spectrum.real, spectrum.imag)[:, 0]
        with np.errstate(invalid="ignore"):
            most = np.maximum(own.sizes, sizes.max(axis=1))
        taken[i] &= np.isfinite(sizes).all() and not np.any(most > own.limits)
        if not taken[i]:
            continue
        moment = np.ascontiguousarray(windows.moment[i : i + 1].T)
        begin = float(largest[i]), int(windows.place[i]), spectrum
        one = LineWindows(*begin, None, yes, yes, None, None, None, None, None, np.inf, moment)
        rows, largest[i] = process_lines(settings, own.moments, one)
        found.append(rows._replace(moment=rows.moment.T))
        own.sizes[:] = 0.0 if own.ends else most
        if own.ends:
            own.limits[:] = np.where(most > 0, factor * most, np.inf)
    if not found:
        lines = len(columns)
        empty = [np.zeros((0, lines))] * 7 + [np.zeros((0, lines), np.bool_), np.zeros(0), np.zeros((3, 0))]
        return LineRows._make([*empty, np.zeros(0, np.bool_)]), largest, taken
    joined = LineRows(*map(np.concatenate, zip(*found)))
    return joined._replace(moment=joined.moment.T), largest, taken


def add_windows(
    moments: LineMoments, forgetting: float, weights: Floats, place: int, spectra: Complex, powers: Floats, used: Flags
) -> MomentRows:
    """Add windows at consecutive places, from `place` on, and return the moments after each.

    Parameters
    ----------
    moments, forgetting, weights
        As those of `process_lines`.
    spectra, powers
        Numerator, denominator and reference, shape (3, rows, lines), and the four powers, shape (4, rows, lines).
    used
        Windows that are added; others change nothing, shape (rows,).
    """
    with np.errstate(all="ignore"):
        new = _parts_of(spectra, powers)
        _, after, means, scatter, _ = _add(moments, forgetting, weights, place, new, used, own=True)
    return MomentRows(after, means, scatter)


def _process(s: LineSettings, moments: LineMoments, w: LineWindows) -> tuple[LineRows, float]:
    lines = moments.means.shape[2]
    output, denominator, reference = (w.spectrum[at, :, :lines] for at in (0, s.denominator, s.reference))
    power = _power(reference)
    largest = np.maximum.accumulate(np.r_[w.largest, np.where(w.whole, power.max(axis=1), 0.0)])
    excited = (power > _EXCITED * largest[1:, np.newaxis]) & (power > 0)
    usable = w.clean & excited.any(axis=1)
    if w.aside is not None:
        usable &= ~w.aside
    moving = np.zeros(len(power), dtype=np.bool_) if w.moving is None else w.moving
    noise = np.zeros(power.shape) if w.noise is None else w.noise
    pair = _times_conjugate(np.stack([output, denominator]), reference)
    powers = np.stack([power, _power(output), noise, _power(denominator)])
    # `new` receives the noise of the mean where a window has none, after its own is used.
    new = _parts_of(np.concatenate([pair, reference[np.newaxis]]), powers)
    added = _add(moments, s.forgetting, s.weights, w.place, new, usable, own=s.averages)
    before, after, means, scatter, deviation = added
    count = after if s.averages else before
    sums = WeightSums.after(count, s.forgetting, s.weights)
    moment = _take_moment(moments, s, w, after, usable) if s.averages else w.moment.copy()

    ratio, _ = _ratio(means)
    changes = _take_changes(moments, s, w.place, ratio, deviation, (before, after), usable)
    scatter_noise, changed = _divided_scatter(moments, s, w.place, _unexplained(ratio, scatter), changes, count, usable)
    value, variance, variation = _estimate(s, sums, means, pair, (scatter_noise, changed), noise, moving)
    dof = _dof(s, sums, moving)
    seen = w.whole if s.averages else w.clean  # an average continues through windows that it excludes
    valid = seen[:, np.newaxis] & excited & np.isfinite(value)
    distortion = np.full(value.shape, np.nan)
    if w.distortion is not None:
        distortion = w.distortion[w.verdict]
        variance, dof = _contained(variance, dof, distortion, w.dof_repeating)
    distortion = np.where(valid, distortion, np.nan)
    if w.invalid is not None:
        against = w.invalid[w.verdict]
        distortion, valid = np.where(valid & against, np.inf, distortion), valid & ~against
    weight = _weight(s, means, pair, power)
    several = valid & np.isfinite(sums.dof)[:, np.newaxis]
    of_input = np.full(value.shape, np.nan)
    if s.denominator != s.reference:
        of_input = np.where(several, _coherence(means, sums, 2, 9), np.nan)
    nothing = complex(np.nan, np.nan)
    return LineRows(
        np.where(valid, value, nothing),
        np.sqrt(np.where(valid, variance, np.nan)),
        np.where(several, _coherence(means, sums, 0, 7), np.nan),
        of_input,
        np.where(valid, weight, nothing),
        distortion,
        np.sqrt(np.where(valid, variation, np.nan)),
        valid,
        dof,
        moment,
        usable,
    ), float(largest[-1])


def _power(spectrum: Complex) -> Floats:
    return np.asarray(spectrum.real * spectrum.real + spectrum.imag * spectrum.imag)


def _times_conjugate(one: Complex, other: Complex) -> Complex:
    product = np.empty(np.broadcast_shapes(one.shape, other.shape), dtype=np.complex128)
    product.real = one.real * other.real + one.imag * other.imag
    product.imag = one.imag * other.real - one.real * other.imag
    return product


def _quotient(numerator: Complex, denominator: Complex) -> tuple[Complex, Floats]:
    """Numerator over denominator, and 1/|denominator|²."""
    inverse = 1 / _power(denominator)
    product = _times_conjugate(numerator, denominator)
    quotient = np.empty_like(product)
    quotient.real, quotient.imag = product.real * inverse, product.imag * inverse
    return quotient, inverse


def _ratio(means: Floats) -> tuple[Complex, Floats]:
    """Value of the means, and 1/|denominator|²."""
    of_means = np.empty((2, *means.shape[1:]), dtype=np.complex128)
    of_means.real, of_means.imag = means[0:4:2], means[1:4:2]
    return _quotient(*of_means)


def _unexplained(ratio: Complex, scatter: Floats) -> Floats:
    """Scatter of numerator − ratio·denominator over the periods."""
    # Feedback carries noise into both; the difference contains only what the plant does not explain.
    shared = ratio.real * scatter[2] + ratio.imag * scatter[3]
    total = scatter[0] - 2 * shared + _power(ratio) * scatter[1]
    return np.asarray(np.maximum(total, 0.0))  # rounding can make it negative


def _take_changes(
    moments: LineMoments,
    s: LineSettings,
    place: int,
    ratio: Complex,
    deviation: Floats,
    counts: tuple[Integers, Integers],
    usable: Flags,
) -> Floats:
    """Changes with each window, or without it where values are those of single windows, shape (5, rows, lines)."""
    before, after = (WeightSums.after(count, s.forgetting, s.weights) for count in counts)
    share = 1 / after.one
    turn = np.where(counts[0] > 0, (1 - share) * (1 + before.ages / before.one), 0.0)
    kept = np.empty((CHANGES, *ratio.shape))
    for row, is_used in enumerate(usable):
        state = moments.change[:, (place + row) % moments.windows.size]
        if not s.averages:
            kept[:, row] = state
        if is_used:
            of, (re, im, den_re, den_im) = ratio[row], deviation[:4, row]
            now = np.stack([re - (of.real * den_re - of.imag * den_im), im - (of.real * den_im + of.imag * den_re)])
            now = np.where(np.isfinite(now), now, 0.0)
            step = now - state[3:]
            squares = step * step
            state[0] = state[0] * s.forgetting + (squares[0] + squares[1])
            state[1:3] = state[1:3] * s.forgetting + now * turn[row]
            state[3:] = now * (1 - share[row])
        if s.averages:
            kept[:, row] = state
    return kept


def _divided_scatter(
    moments: LineMoments,
    s: LineSettings,
    place: int,
    total: Floats,
    changes: Floats,
    count: Integers,
    usable: Flags,
) -> tuple[Floats, Floats]:
    """Noise of one window, and the variance of the response about what the value is of, shape (rows, lines).

    A trend is tested as a regression is; what else is slower than a period has more scatter than steps.
    """
    w = WeightSums.after(count, s.forgetting, s.weights)
    dof = w.dof - 1
    known = dof >= 2
    slope, periods = 1 / w.spread, w.one * w.one / w.two
    share = np.where(known, 1 / (w.unbiased - w.spread_two * slope), np.nan)[:, np.newaxis]
    steps_of = 0.5 / WeightSums.after(np.maximum(count - 1, 0), s.forgetting, s.weights).one
    steps = changes[0] * np.where(known, steps_of, np.nan)[:, np.newaxis]
    trend = changes[1] * changes[1] + changes[2] * changes[2]
    rest = np.maximum(0.0, total - trend * slope[:, np.newaxis]) * share
    every = total * (1 / w.unbiased)[:, np.newaxis]
    own = trend > rest * (w.spread_two * _exceeded(_LOG_RARE, dof))[:, np.newaxis]
    trending = np.count_nonzero(trend > rest * (w.spread_two * _exceeded(_LOG_USUAL, dof))[:, np.newaxis], axis=1)
    varying = np.count_nonzero(every > steps, axis=1)
    trends, varies = _judged_changes(moments, place, trending, varying, usable)
    slower = rest > np.where(varies[:, np.newaxis], steps, steps * 2.5)
    trends = np.where(trends[:, np.newaxis], ~np.isnan(rest), own | slower)
    linear_of = _LINEAR * slope * slope * (periods * periods if s.averages else 1.0)
    linear = np.maximum(0.0, trend - rest * w.spread_two[:, np.newaxis]) * linear_of[:, np.newaxis]
    noise = np.where(slower, steps, np.where(trends, rest, every))
    variation = np.where(trends, linear, np.where(np.isnan(rest), rest, 0.0))
    more = np.where(slower, (rest - steps) * (_ERRATIC if s.averages else 0.0), 0.0)
    return noise, variation + more


def _judged_changes(
    moments: LineMoments, place: int, trending: Integers, varying: Integers, usable: Flags
) -> tuple[Flags, Flags]:
    """Whether more lines than chance explains had a trend, or more scatter than steps, in the window before."""
    lines = float(moments.means.shape[2])
    trends, varies = np.zeros(usable.size, np.bool_), np.zeros(usable.size, np.bool_)
    for row, is_used in enumerate(usable):
        of_place = moments.moment[:, (place + row) % moments.windows.size]
        excess, more = 4 * of_place[_TRENDS] - lines, 2 * of_place[_SCATTERS] - lines
        varies[row] = more > 0.3 * lines and more * more > 6.25 * lines
        trends[row] = varies[row] or (excess > 0.6 * lines and excess * excess > 18.75 * lines)
        if is_used:
            of_place[_TRENDS], of_place[_SCATTERS] = trending[row], varying[row]
    return trends, varies


def _exceeded(log: float, dof: Floats) -> Floats:
    """d·(exp(log/d) − 1): what F(2, 2d) exceeds with the probability exp(−log), as (1 + x/64)^64 by squares."""
    power = 1 + log / (64 * dof)
    for _ in range(6):
        power = power * power
    return np.asarray(dof * (power - 1))


def _estimate(
    s: LineSettings,
    sums: WeightSums,
    means: Floats,
    pair: Complex,
    parts: tuple[Floats, Floats],
    noise: Floats,
    moving: Flags,
) -> tuple[Complex, Floats, Floats]:
    """Value, its variance, and the part of that from changes, shape (rows, lines)."""
    ratio, inverse = _ratio(means)
    variance, variation = parts
    if s.noise != NOISE_SCATTER:
        beside = means[_NOISE] if s.averages else noise
        if s.noise == NOISE_LARGER:
            variance = np.fmax(variance, np.where(np.isfinite(variance), means[_NOISE], beside))
        # Where the machine moves, the scatter between periods contains the motion.
        variance = np.where(moving[:, np.newaxis], beside, variance)
    value = ratio
    if s.averages:
        variance = variance * sums.of_mean[:, np.newaxis]
    else:
        value, inverse = _quotient(*pair)
    variation = np.where(moving[:, np.newaxis], np.nan, variation * inverse)
    return value, variance * inverse + np.where(np.isnan(variation), 0.0, variation), variation


def _dof(s: LineSettings, sums: WeightSums, moving: Flags) -> Floats:
    dof = sums.dof
    if s.noise == NOISE_LARGER:
        dof = np.where(np.isfinite(dof), dof, s.noise_dof)
    if s.noise != NOISE_SCATTER:
        dof = np.where(moving, s.noise_dof / (sums.of_mean if s.averages else 1.0), dof)
    return dof


def _contained(variance: Floats, dof: Floats, distortion: Floats, dof_repeating: float) -> tuple[Floats, Floats]:
    """Variance (rows, lines) and degrees of freedom (rows,) of noise and distortion together.

    The degrees of freedom are matched in two moments (Satterthwaite 1946); the least of all lines is used. A distortion
    that is not known (NaN) adds nothing.
    """
    added = np.where(np.isfinite(distortion), distortion * distortion, 0.0)
    together = variance + added
    noise_share, added_share = (1 / dof)[:, np.newaxis], np.divide(1.0, dof_repeating)
    of_line = together * together / (variance * variance * noise_share + added * added * added_share)
    least = np.where(np.isfinite(of_line), of_line, np.inf).min(axis=1)
    return together, np.where((added > 0).any(axis=1), np.fmin(dof, least), dof)


def _coherence(means: Floats, sums: WeightSums, signal: int, of_signal: int) -> Floats:
    """γ² of the reference and a signal, Nevaranta 2016, eq. (18), without its bias of (1 − γ²)/m over m periods."""
    coherence = (means[signal] * means[signal] + means[signal + 1] * means[signal + 1]) / (means[6] * means[of_signal])
    bias = (1 / (1 - sums.of_mean))[:, np.newaxis]
    return np.asarray(np.maximum(1 - (1 - coherence) * bias, 0.0))


def _weight(s: LineSettings, means: Floats, pair: Complex, power: Floats) -> Complex:
    """Weight of a response in a mean, so that the mean is a ratio of averages: U/W, for the direct estimator |U|²."""
    if s.denominator == s.reference:
        return np.asarray(power + 0j, dtype=np.complex128)
    weight = np.empty(power.shape, dtype=np.complex128)
    if s.averages:
        weight.real, weight.imag = means[2] / means[6], means[3] / means[6]
    else:
        weight.real, weight.imag = pair[1].real / power, pair[1].imag / power
    return weight


def _parts_of(spectra: Complex, powers: Floats) -> Floats:
    """Real and imaginary parts of three spectra, and four powers: shape (10, rows, lines)."""
    new = np.empty((MEANS, *spectra.shape[1:]))
    new[0:6:2], new[1:6:2], new[6:] = spectra.real, spectra.imag, powers
    return new


def _add(
    moments: LineMoments, forgetting: float, weights: Floats, place: int, new: Floats, usable: Flags, *, own: bool
) -> tuple[Integers, Integers, Floats, Floats, Floats]:
    """Counts without and with each window; means and scatter with it (`own`), or without it; deviations of each."""
    parts = _parts(place, moments.windows.size, usable)
    before, after = np.empty(usable.size, dtype=np.int64), np.empty(usable.size, dtype=np.int64)
    for places, at, used in parts:
        before[at] = moments.windows[places]
        moments.windows[places] += used
        after[at] = moments.windows[places]
    share = 1 / WeightSums.after(after, forgetting, weights).one
    means, deviation = _take_means(moments.means, parts, new, share, own=own)
    products = _products(deviation) * (1 - share)[:, np.newaxis]
    return before, after, means, _take_scatter(moments.scatter, parts, products, forgetting, own=own), deviation


def _parts(place: int, places: int, usable: Flags) -> list[_Part]:
    """Stretches of rows that are in one period and are all usable or all not: their places, their rows, and which."""
    rows = np.arange(1, usable.size)
    cut = (np.diff(usable.view(np.int8)) != 0) | ((place + rows) % places == 0)
    edges = [0, *(rows[cut]).tolist(), usable.size]
    parts = []
    for start, stop in pairwise(edges):
        at = (place + start) % places
        if stop > start:
            parts.append((slice(at, at + stop - start), slice(start, stop), bool(usable[start])))
    return parts


def _take_means(state: Floats, parts: list[_Part], new: Floats, share: Floats, *, own: bool) -> tuple[Floats, Floats]:
    kept, deviation = np.empty_like(new), np.zeros_like(new)
    column = share[:, np.newaxis]
    for places, at, usable in parts:
        means = state[:, places]
        if not own:
            kept[:, at] = means
        if usable:
            known, now = means[_NOISE], new[_NOISE, at]
            # A window with the start or end of the excitation has no noise estimate: the mean is of the others.
            means[_NOISE] = np.where(np.isnan(known), now, known)
            new[_NOISE, at] = np.where(np.isnan(now) & (column[at] < 1), means[_NOISE], now)
            np.subtract(new[:, at], means, out=deviation[:, at])
            means += deviation[:, at] * column[at]
        if own:
            kept[:, at] = means
    return kept, deviation


def _products(deviation: Floats) -> Floats:
    """|δnum|², |δden|², and δnum·conj(δden) in real and imaginary part, shape (4, rows, lines)."""
    numerator, denominator = deviation[0:2], deviation[2:4]
    squares = deviation[:4] * deviation[:4]
    straight, crosswise = numerator * denominator, numerator[::-1] * denominator
    return np.stack(
        [squares[0] + squares[1], squares[2] + squares[3], straight[0] + straight[1], crosswise[0] - crosswise[1]]
    )


def _take_scatter(state: Floats, parts: list[_Part], products: Floats, forgetting: float, *, own: bool) -> Floats:
    kept = np.empty_like(products)
    for places, at, usable in parts:
        scatter = state[:, places]
        if not own:
            kept[:, at] = scatter
        if usable:
            scatter *= forgetting
            scatter += products[:, at]
        if own:
            kept[:, at] = scatter
    return kept


def _take_moment(moments: LineMoments, s: LineSettings, w: LineWindows, after: Integers, usable: Flags) -> Floats:
    """Means of time and schedule, and the oldest sample; those of the window until there is a mean."""
    kept = w.moment.copy()
    share = 1 / WeightSums.after(after, s.forgetting, s.weights).one
    for places, at, used in _parts(w.place, moments.windows.size, usable):
        mean = moments.moment[:3, places]
        if used:
            mean[2] = np.where(share[at] < 1, mean[2], w.moment[2, at])
            mean[:2] += (w.moment[:2, at] - mean[:2]) * share[at]
        kept[:, at] = np.where(after[at] > 0, mean, kept[:, at])
    return kept
