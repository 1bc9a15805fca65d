"""Margins read from open loops: crossings, slopes, and the resulting values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.analysis._margins import EXTRAPOLATED, INTERPOLATED, MARGIN_NAMES, NONE, UNSTABLE, Margins
from livebode.analysis.crossings import Crossings, crossings, nearest_to_minus_one
from livebode.analysis.open_loop import OpenLoop, stable
from livebode.arrays import Complex, Floats
from livebode.core import Parameters, UsageError
from livebode.kernel import MarginGrid, fit_margins

_DB = 20 / np.log(10)
_ROWS = 64  # evaluated at once: some 2 MB a grid
_STEP = 1e-5  # of a frequency: central differences of ln L have an error of 1e-10
_PEAK_STEP = 1e-3  # differences of slopes, which are themselves differences, need a larger step
_OF_SIGMA, _OF_VALUE = 1e-3, 1e-7  # step of a parameter


class FittedValues(NamedTuple):
    """Values and their sigma, shape (rows, parameters)."""

    values: Floats
    sigma: Floats

    def of(self, row: NDArray[np.int64]) -> FittedValues:
        return FittedValues(self.values[row], self.sigma[row])


class Slopes(NamedTuple):
    """Slopes of ln L at places: by ln f, shape (places,), and by each parameter in its sigmas, (places, parameters)."""

    by_frequency: Complex
    by_parameter: Complex

    def part(self, places: slice) -> Slopes:
        return Slopes(self.by_frequency[places], self.by_parameter[places])


def margins(fits: Parameters, loop: OpenLoop, band_hz: tuple[float, float]) -> Margins:
    """Margins of the loop at each row of `fits`.

    Read from L = F·G(fit) where it crosses, exact to 1e-10 of a frequency, on the model and never between lines without
    one. Linear propagation of the fit's covariance: valid if the covariance is (docs/how-to/margins.md), and if the
    critical crossing remains the critical one.

    Parameters
    ----------
    fits
        Parameters of `loop.plant`.
    loop
        The controllers around it.
    band_hz
        Lowest and highest line of the fits.

    Raises
    ------
    UsageError
        If the band is not two ascending positive frequencies below half the rate.

    Examples
    --------
    >>> from livebode import PID, Lines, Loop, Response
    >>> from livebode.fitting import fit
    >>> from livebode.simulation import BeltAxis
    >>> lines = Lines.parse("20:140:5", rate_hz=4000, window=800)
    >>> ones, truth = np.ones(len(lines)), BeltAxis().linear(0.8).sampled(4000.0).response(lines.frequency_hz)
    >>> measured = Response(lines, truth, 1e-3 * ones, np.inf, ones, ones > 0, 0, 799, 0.1)
    >>> found = fit(measured, "two-mass", radius_m=0.019)
    >>> loop = OpenLoop(found.model, Loop(feedback=PID(gain=1.0, rate_hz=4000, delay_ticks=4)), found.rate_hz)
    >>> of_it = margins(found.parameters, loop, found.band_hz)
    >>> of_it.of("phase_margin").round(2), of_it.of("gain_margin").round(2), of_it.place[0, 2].item()
    (array([61.32]), array([11.58]), 'interpolated')
    """
    low, high = band_hz
    if not 0 < low <= high <= loop.rate_hz / 2:
        raise UsageError(
            "out-of-range",
            f"{band_hz=} is not two ascending frequencies up to half the rate of {loop.rate_hz:g} Hz",
            "give the lowest and the highest frequency that the fits are valid for",
            argument="band_hz",
            value=[float(low), float(high)],
            rate_hz=loop.rate_hz,
        )
    result = _nothing(fits)
    rows = np.flatnonzero(fits.ok)
    for alike, grid in loop.grids(fits.value[rows], band_hz) if rows.size else ():
        if loop.native is not None:
            _read_natively(result, rows[alike], fits, loop, grid)
            continue
        for part in _parts(rows[alike]):
            _read(result, part, fits.value[part], fits.covariance[part], loop, grid)
    place = np.where((result.frequency_hz >= low) & (result.frequency_hz <= high), INTERPOLATED, EXTRAPOLATED)
    result.place[:] = np.where(np.isnan(result.frequency_hz), NONE, place)
    return result


def _read_natively(
    result: Margins, rows: NDArray[np.int64], fits: Parameters, loop: OpenLoop, grid: MarginGrid
) -> None:
    """Write the margins as `_read` does, row by row in C; equal to rounding."""
    assert loop.native is not None  # the caller has examined it
    model, series = loop.native
    of = fit_margins(model, series, grid, fits.value[rows], fits.covariance[rows])
    result.status[rows[~of.stable]] = UNSTABLE
    result.value[rows], result.sigma[rows] = of.value, of.sigma
    result.frequency_hz[rows], result.frequency_sigma_hz[rows] = of.frequency_hz, of.frequency_sigma_hz


def _parts(rows: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    return (rows[i : i + _ROWS] for i in range(0, len(rows), _ROWS))


def _nothing(fits: Parameters) -> Margins:
    shape = len(fits), len(MARGIN_NAMES)
    status = fits.status.astype(f"<U{max(len(UNSTABLE), fits.status.dtype.itemsize // 4)}")
    return Margins(
        value=np.full(shape, np.nan),
        sigma=np.full(shape, np.nan),
        frequency_hz=np.full(shape, np.nan),
        frequency_sigma_hz=np.full(shape, np.nan),
        place=np.full(shape, NONE, dtype="<U12"),
        status=status,
        sample=fits.sample,
        time_s=fits.time_s,
        schedule=fits.schedule,
    )


def _read(
    result: Margins,
    rows: NDArray[np.int64],
    values: Floats,
    covariance: Floats,
    loop: OpenLoop,
    points: MarginGrid,
) -> None:
    """Write the margins of `rows`, which share the points of a grid, into `found`."""
    f = points.frequency_hz
    grid = loop.at(values, f)
    steady = stable(grid, f, loop.unstable_poles(values))
    result.status[rows[~steady]] = UNSTABLE
    if not steady.any():
        return
    rows, values, covariance, grid = rows[steady], values[steady], covariance[steady], grid[steady]
    at_gain, at_phase, at_bandwidth = crossings(loop, values, f, grid)
    at_peak = nearest_to_minus_one(loop, values, f, grid)
    size = np.log(np.abs(at_phase.open_loop))
    turn_deg = np.degrees(np.angle(-at_gain.open_loop))
    late_ms = np.degrees(np.angle(-at_gain.open_loop) % (2 * np.pi)) / 360e-3 / at_gain.frequency_hz
    chosen = (
        _nearest(at_phase, -size, size < 0),
        _nearest(at_phase, size, size >= 0),
        _nearest(at_gain, np.abs(turn_deg)),
        _nearest(at_gain, late_ms),
        at_peak,
        at_bandwidth,
    )
    sigma = np.sqrt(np.einsum("rii->ri", covariance))
    unit = np.where(sigma > 0, sigma, 1.0)
    correlation = covariance / unit[:, :, np.newaxis] / unit[:, np.newaxis]
    fits = FittedValues(values, sigma)
    everywhere = slopes(loop, fits, Crossings(*(np.concatenate(parts) for parts in zip(*chosen))))
    ends = np.cumsum([0, *(len(crossing.row) for crossing in chosen)])
    for column, crossing in enumerate(chosen):
        reading = _READING[column](loop, fits, crossing, everywhere.part(slice(ends[column], ends[column + 1])))
        _write(result, rows, column, crossing, reading, correlation)


def _write(
    result: Margins, rows: NDArray[np.int64], column: int, crossing: Crossings, reading: Reading, correlation: Floats
) -> None:
    value, by, by_log_f = reading
    result.value[rows, column], result.sigma[rows, column] = np.inf, 0.0
    if column == MARGIN_NAMES.index("bandwidth"):
        result.value[rows, column], result.sigma[rows, column] = np.nan, np.nan
    to = rows[crossing.row]
    result.value[to, column] = value
    result.frequency_hz[to, column] = crossing.frequency_hz
    result.sigma[to, column] = _spread(by, correlation[crossing.row])
    result.frequency_sigma_hz[to, column] = crossing.frequency_hz * _spread(by_log_f, correlation[crossing.row])


def _spread(by: Floats, correlation: Floats) -> Floats:
    """Sigma of a quantity from its changes per sigma of each parameter."""
    return np.asarray(np.sqrt(np.einsum("ri,rij,rj->r", by, correlation, by).clip(0)))


def _nearest(places: Crossings, cost: Floats, counts: NDArray[np.bool_] | None = None) -> Crossings:
    """The place of least cost in each row."""
    kept = np.arange(len(cost)) if counts is None else np.flatnonzero(counts)
    order = kept[np.lexsort((cost[kept], places.row[kept]))]
    _, first = np.unique(places.row[order], return_index=True)
    chosen = order[first]
    return Crossings(places.row[chosen], places.frequency_hz[chosen], places.open_loop[chosen])


Reading = tuple[Floats, Floats, Floats]


def _gain(loop: OpenLoop, _fits: FittedValues, crossing: Crossings, along: Slopes) -> Reading:
    """−|L| in dB where L is negative. At half the rate, the place itself is fixed."""
    by_f, by = along
    by_log_f = moved(by_f.imag, by.imag)
    by_log_f[crossing.frequency_hz >= loop.rate_hz / 2] = 0.0
    moving = by.real + by_f.real[:, np.newaxis] * by_log_f
    return -_DB * np.log(np.abs(crossing.open_loop)), -_DB * moving, by_log_f


def _reduction(loop: OpenLoop, fits: FittedValues, crossing: Crossings, along: Slopes) -> Reading:
    value, by, by_log_f = _gain(loop, fits, crossing, along)
    return -value, -by, by_log_f


def _phase(_loop: OpenLoop, _fits: FittedValues, crossing: Crossings, along: Slopes) -> Reading:
    """Angle of −L where |L| = 1, deg."""
    by_f, by = along
    by_log_f = moved(by_f.real, by.real)
    turn = np.degrees(np.angle(-crossing.open_loop))
    return turn, np.degrees(by.imag + by_f.imag[:, np.newaxis] * by_log_f), by_log_f


def _delay(loop: OpenLoop, fits: FittedValues, crossing: Crossings, along: Slopes) -> Reading:
    """The delay that rotates L to −1 where |L| = 1, ms."""
    turn, by_turn, by_log_f = _phase(loop, fits, crossing, along)
    late = (turn % 360) / 360e-3 / crossing.frequency_hz
    by = by_turn / 360e-3 / crossing.frequency_hz[:, np.newaxis] - late[:, np.newaxis] * by_log_f
    return late, by, by_log_f


def _peak(loop: OpenLoop, fits: FittedValues, crossing: Crossings, along: Slopes) -> Reading:
    """1/|1 + L| at its maximum; to first order a shift of the place has no effect."""
    largest = 1 / np.abs(1 + crossing.open_loop)
    closed = crossing.open_loop / (1 + crossing.open_loop)
    by = -largest[:, np.newaxis] * (closed[:, np.newaxis] * along.by_parameter).real
    return largest, by, peak_moved(loop, fits, crossing)


def _bandwidth(_loop: OpenLoop, _fits: FittedValues, crossing: Crossings, along: Slopes) -> Reading:
    by_f, by = along
    sensitivity = 1 / (1 + crossing.open_loop)
    by_log_f = moved((sensitivity * by_f).real, (sensitivity[:, np.newaxis] * by).real)
    return crossing.frequency_hz, crossing.frequency_hz[:, np.newaxis] * by_log_f, by_log_f


_READING = (_gain, _reduction, _phase, _delay, _peak, _bandwidth)


def slopes(loop: OpenLoop, fits: FittedValues, crossing: Crossings) -> Slopes:
    """Central differences of ln L at these places; by frequency one-sided at half the rate."""
    return _slopes(loop, fits.of(crossing.row), crossing.frequency_hz)


def _slopes(loop: OpenLoop, fits: FittedValues, frequency_hz: Floats) -> Slopes:
    """For one row of fits and one frequency each. A parameter without variance is not moved: it may be at its limit."""
    values, sigma = fits
    places, n = values.shape
    above, below = np.minimum(frequency_hz * (1 + _STEP), loop.rate_hz / 2), frequency_hz * (1 - _STEP)
    free = np.flatnonzero(np.any(sigma > 0, axis=0))
    step = np.maximum(_OF_SIGMA * sigma, _OF_VALUE * np.abs(values))[:, free]
    shifts = (step[:, :, np.newaxis] * np.eye(n)[free]).swapaxes(0, 1)
    # All in one call: for few places the number of calls determines the time.
    tried = np.concatenate([values[np.newaxis], values[np.newaxis], values + shifts, values - shifts])
    at_hz = np.concatenate([above, below, np.tile(frequency_hz, 2 * free.size)])
    open_loop = loop.at(tried.reshape(-1, n), at_hz[:, np.newaxis]).reshape(len(tried), places)
    by_frequency = np.log(open_loop[0] / open_loop[1]) / np.log(above / below)
    plus, minus = open_loop[2 : 2 + free.size], open_loop[2 + free.size :]
    by_parameter = np.zeros(values.shape, dtype=np.complex128)
    # A parameter that only some rows move has no step in the others where it is zero.
    shares = np.divide(sigma[:, free], 2 * step, out=np.zeros(step.shape), where=step > 0)
    by_parameter[:, free] = np.log(plus / minus).T * shares
    return Slopes(np.asarray(by_frequency, dtype=np.complex128), by_parameter)


def moved(residual: Floats, by: Floats) -> Floats:
    """d ln f by each parameter for the root of a function: −(slope by parameter)/(slope by ln f)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(-by / residual[:, np.newaxis])


def peak_moved(loop: OpenLoop, fits: FittedValues, crossing: Crossings) -> Floats:
    """d ln f by each parameter of the frequency where |1 + L| is least; NaN at half the rate, where it is fixed."""
    inside = crossing.frequency_hz < loop.rate_hz / 2
    slope = np.full((len(crossing.row), fits.values.shape[1]), np.nan)
    if inside.any():
        f, row = crossing.frequency_hz[inside], crossing.row[inside]
        both = np.concatenate([f * np.exp(-_PEAK_STEP), f * np.exp(_PEAK_STEP)])
        by_f, by = _distance_slopes(loop, fits.of(np.tile(row, 2)), both)
        slope[inside] = moved(by_f[len(f) :] - by_f[: len(f)], by[len(f) :] - by[: len(f)])
    return slope


def _distance_slopes(loop: OpenLoop, fits: FittedValues, frequency_hz: Floats) -> tuple[Floats, Floats]:
    """Slopes of ln|1 + L|: by ln f and by each parameter."""
    value = loop.at(fits.values, frequency_hz[:, np.newaxis])[:, 0]
    closed = value / (1 + value)
    by = _slopes(loop, fits, frequency_hz)
    return (closed * by.by_frequency).real, (closed[:, np.newaxis] * by.by_parameter).real
