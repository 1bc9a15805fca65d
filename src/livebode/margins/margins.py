"""Margins of the loop at each fit, with bounds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.margins.crossings import (
    Crossings,
    bandwidth_crossings,
    gain_crossings,
    nearest_to_minus_one,
    phase_crossings,
)
from livebode.margins.open_loop import OpenLoop
from livebode.margins.slopes import Fits, moved, peak_moved, slopes
from livebode.margins.stability import stable
from livebode.nouns import InputError, Parameters
from livebode.nouns.parameters import OK

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

NAMES = (
    "gain_margin",
    "gain_reduction",
    "phase_margin",
    "delay_margin",
    "peak_sensitivity",
    "bandwidth",
)
UNITS = ("dB", "dB", "deg", "ms", "", "Hz")
UNSTABLE = "unstable by the fit"
NONE, INTERPOLATED, EXTRAPOLATED = "none", "interpolated", "extrapolated"

_DB = 20 / np.log(10)
_ROWS = 64  # evaluated at once: some 2 MB a grid
_PER_ROW = ("value", "sigma", "frequency_hz", "frequency_sigma_hz", "place", "status", "sample", "time_s", "schedule")


@dataclass(frozen=True, eq=False)
class Margins:
    """Margins of the closed loop, a row for each fit. Immutable.

    Attributes
    ----------
    names, units
        Of the columns. ``gain_margin``: dB by which the loop's gain may rise; ``gain_reduction``: dB by which it may
        fall; ``phase_margin``: the smallest turn of L, deg, that makes it unstable, at any crossing of |L| = 1 (negative
        for a turn ahead); ``delay_margin``: ms; ``peak_sensitivity``: Ms, largest |S|; ``bandwidth``: where |T| first
        falls 3 dB below one, Hz.
    value, sigma
        Shape (rows, margins); sigma by linear propagation of the fit's covariance. Infinite (0 for sigma) where there
        is no crossing, so that nothing of the kind can make the loop unstable; NaN where `status` is not "ok".
    frequency_hz, frequency_sigma_hz
        Where each was read, and how sure that place is; NaN where there is none.
    place
        ``interpolated`` by the fitted model within the band of the lines, ``extrapolated`` by it beyond, or ``none``.
    status
        Shape (rows,): "ok", the fit's reason, or that the fitted plant would make the loop unstable.
    sample, time_s, schedule
        Those of the fit.
    """

    value: Floats
    sigma: Floats
    frequency_hz: Floats
    frequency_sigma_hz: Floats
    place: NDArray[np.str_]
    status: NDArray[np.str_]
    sample: NDArray[np.int64]
    time_s: Floats
    schedule: Floats

    names = NAMES
    units = UNITS

    def __len__(self) -> int:
        return len(self.sample)

    def __getitem__(self, at: slice | NDArray[Any]) -> Margins:
        return replace(self, **{name: getattr(self, name)[at] for name in _PER_ROW})

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Rows that hold numbers, shape (rows,)."""
        return np.asarray(self.status == OK)

    def of(self, name: str) -> Floats:
        """The values of one margin, shape (rows,)."""
        return np.asarray(self.value[:, self.index(name)])

    def index(self, name: str) -> int:
        """Column of a margin; InputError with the known names where it is not one."""
        if name not in NAMES:
            raise InputError(f"there is no margin {name!r}; choose from {', '.join(NAMES)}")
        return NAMES.index(name)

    def bound(self, probability: float = 0.95) -> Floats:
        """Half-width of the interval that holds the truth with this probability, shape (rows, margins).

        Raises
        ------
        InputError
            If the probability is not between 0 and 1.
        """
        if not 0 < probability < 1:
            raise InputError(f"{probability=} is not between 0 and 1; 0.95 is usual")
        from scipy.special import ndtri

        return np.asarray(self.sigma * float(ndtri(0.5 + probability / 2)))

    @classmethod
    def join(cls, parts: list[Margins]) -> Margins:
        """Parts of one run, in order, as one."""
        if not parts:
            raise InputError("there are no margins to join; give at least one part")
        return cls(**{name: np.concatenate([getattr(p, name) for p in parts]) for name in _PER_ROW})


def margins(fits: Parameters, loop: OpenLoop, band_hz: tuple[float, float]) -> Margins:
    """Margins of the loop at each row of `fits`.

    Read from L = F·G(fit) where it crosses, exact to 1e-10 of a frequency, on the model and never between lines without
    one. Linear propagation of the fit's covariance: right where the covariance is (docs/margins.md), and where the
    crossing that is nearest to harm stays the nearest.

    Parameters
    ----------
    fits
        Parameters of `loop.plant`.
    loop
        The controllers around it.
    band_hz
        Lowest and highest line that the fits are of.

    Raises
    ------
    InputError
        If the band is not two ascending positive frequencies below half the rate.

    Examples
    --------
    >>> from livebode.fitting.chains import Rigid
    >>> from livebode.nouns import PID, Loop
    >>> loop = OpenLoop(Rigid(), Loop(feedback=PID(gain=0.2, rate_hz=4000)), rate_hz=4000)
    >>> fits = Parameters.of_values(Rigid(), [[0.005, 0.0, 0.0]]) # doctest: +SKIP
    """
    low, high = band_hz
    if not 0 < low <= high <= loop.rate_hz / 2:
        raise InputError(f"{band_hz=} is not two ascending frequencies up to half the rate of {loop.rate_hz:g} Hz")
    found = _nothing(fits)
    rows = np.flatnonzero(fits.ok)
    for part in _parts(rows):
        _read(found, part, fits.value[part], fits.covariance[part], loop, band_hz)
    return found


def _parts(rows: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    return (rows[i : i + _ROWS] for i in range(0, len(rows), _ROWS))


def _nothing(fits: Parameters) -> Margins:
    shape = len(fits), len(NAMES)
    numbers = {name: np.full(shape, np.nan) for name in _PER_ROW[:4]}
    status = fits.status.astype(f"<U{max(len(UNSTABLE), fits.status.dtype.itemsize // 4)}")
    rest = {"sample": fits.sample, "time_s": fits.time_s, "schedule": fits.schedule}
    return Margins(**numbers, place=np.full(shape, NONE, dtype="<U12"), status=status, **rest)


def _read(
    found: Margins, rows: NDArray[np.int64], values: Floats, covariance: Floats, loop: OpenLoop, band: tuple[float, float]
) -> None:
    """Write the margins of `rows` into `found`."""
    f = loop.frequencies(values, band)
    grid = loop.at(values, f)
    steady = stable(grid, f, loop.unstable_poles(values))
    found.status[rows[~steady]] = UNSTABLE
    if not steady.any():
        return
    rows, values, covariance, grid = rows[steady], values[steady], covariance[steady], grid[steady]
    crossing_of = (gain_crossings, phase_crossings, nearest_to_minus_one, bandwidth_crossings)
    at_gain, at_phase, at_peak, at_bandwidth = (of(loop, values, f, grid) for of in crossing_of)
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
    for column, at in enumerate(chosen):
        _write(found, rows, column, at, _READING[column](loop, Fits(values, sigma), at), correlation)
    place = np.where((found.frequency_hz >= band[0]) & (found.frequency_hz <= band[1]), INTERPOLATED, EXTRAPOLATED)
    found.place[rows] = np.where(np.isnan(found.frequency_hz[rows]), NONE, place[rows])


def _write(
    found: Margins, rows: NDArray[np.int64], column: int, at: Crossings, reading: Reading, correlation: Floats
) -> None:
    value, by, by_log_f = reading
    found.value[rows, column], found.sigma[rows, column] = np.inf, 0.0
    if column == NAMES.index("bandwidth"):
        found.value[rows, column], found.sigma[rows, column] = np.nan, np.nan
    to = rows[at.row]
    found.value[to, column] = value
    found.frequency_hz[to, column] = at.frequency_hz
    found.sigma[to, column] = _spread(by, correlation[at.row])
    found.frequency_sigma_hz[to, column] = at.frequency_hz * _spread(by_log_f, correlation[at.row])


def _spread(by: Floats, correlation: Floats) -> Floats:
    """Sigma of what moves by so much for a sigma of each parameter."""
    return np.sqrt(np.einsum("ri,rij,rj->r", by, correlation, by).clip(0))


def _nearest(places: Crossings, cost: Floats, counts: NDArray[np.bool_] | None = None) -> Crossings:
    """Of each row the place of least cost."""
    kept = np.arange(len(cost)) if counts is None else np.flatnonzero(counts)
    order = kept[np.lexsort((cost[kept], places.row[kept]))]
    _, first = np.unique(places.row[order], return_index=True)
    return Crossings(*(x[order[first]] for x in places))


Reading = tuple[Floats, Floats, Floats]


def _gain(loop: OpenLoop, fits: Fits, at: Crossings) -> Reading:
    """−|L| in dB where L is negative. At half the rate, the place itself stays."""
    by_f, by = slopes(loop, fits, at)
    by_log_f = moved(by_f.imag, by.imag)
    by_log_f[at.frequency_hz >= loop.rate_hz / 2] = 0.0
    moving = by.real + by_f.real[:, np.newaxis] * by_log_f
    return -_DB * np.log(np.abs(at.open_loop)), -_DB * moving, by_log_f


def _reduction(loop: OpenLoop, fits: Fits, at: Crossings) -> Reading:
    value, by, by_log_f = _gain(loop, fits, at)
    return -value, -by, by_log_f


def _phase(loop: OpenLoop, fits: Fits, at: Crossings) -> Reading:
    """Angle of −L where |L| = 1, deg."""
    by_f, by = slopes(loop, fits, at)
    by_log_f = moved(by_f.real, by.real)
    turn = np.degrees(np.angle(-at.open_loop))
    return turn, np.degrees(by.imag + by_f.imag[:, np.newaxis] * by_log_f), by_log_f


def _delay(loop: OpenLoop, fits: Fits, at: Crossings) -> Reading:
    """The delay that turns L to −1 where |L| = 1, ms."""
    turn, by_turn, by_log_f = _phase(loop, fits, at)
    late = (turn % 360) / 360e-3 / at.frequency_hz
    by = by_turn / 360e-3 / at.frequency_hz[:, np.newaxis] - late[:, np.newaxis] * by_log_f
    return late, by, by_log_f


def _peak(loop: OpenLoop, fits: Fits, at: Crossings) -> Reading:
    """1/|1 + L| where it is largest; to first order the place does not matter."""
    largest = 1 / np.abs(1 + at.open_loop)
    closed = at.open_loop / (1 + at.open_loop)
    by = -largest[:, np.newaxis] * (closed[:, np.newaxis] * slopes(loop, fits, at).by_parameter).real
    return largest, by, peak_moved(loop, fits, at)


def _bandwidth(loop: OpenLoop, fits: Fits, at: Crossings) -> Reading:
    by_f, by = slopes(loop, fits, at)
    sensitivity = 1 / (1 + at.open_loop)
    by_log_f = moved((sensitivity * by_f).real, (sensitivity[:, np.newaxis] * by).real)
    return at.frequency_hz, at.frequency_hz[:, np.newaxis] * by_log_f, by_log_f


_READING = (_gain, _reduction, _phase, _delay, _peak, _bandwidth)
