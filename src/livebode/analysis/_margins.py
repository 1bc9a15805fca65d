"""Margins of the loop at each fit, with bounds, and what the lines show without a model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import (
    CIRCLE_FACTOR,
    COVERAGE,
    OK,
    Loop,
    Parameters,
    Responses,
    RowArrays,
    UsageError,
    counted,
    half_width,
)
from livebode.dataclass import dataclass
from livebode.language import Message

MARGIN_WORDS = {
    "gain_margin": Message("gain may rise by"),
    "gain_reduction": Message("gain may fall by"),
    "phase_margin": Message("phase margin"),
    "delay_margin": Message("delay margin"),
    "peak_sensitivity": Message("peak sensitivity Ms"),
    "bandwidth": Message("bandwidth"),
}
"""The margins, with their names for people."""
MARGIN_NAMES = tuple(MARGIN_WORDS)
UNITS = ("dB", "dB", Message("deg"), "ms", "", "Hz")
UNSTABLE = Message("unstable by the fit")
CONTRADICTED = Message("contradicted by the lines")
_CHANCE = 0.01  # of all lines of a row together
NONE, INTERPOLATED, EXTRAPOLATED = Message("none"), Message("interpolated"), Message("extrapolated")


@dataclass(frozen=True, eq=False)
class Margins(RowArrays):
    """Margins of the closed loop, a row for each fit. Immutable.

    Attributes
    ----------
    names, units
        Of the columns. ``gain_margin``: dB by which the loop's gain may rise; ``gain_reduction``: dB by which it may
        fall; ``phase_margin``: the smallest rotation of L, deg, that makes it unstable, at any |L| = 1 (negative
        for phase lead); ``delay_margin``: ms; ``peak_sensitivity``: Ms, largest |S|; ``bandwidth``: where |T| first
        falls 3 dB below one, Hz.
    value, sigma
        Shape (rows, margins); sigma by linear propagation of the fit's covariance. Infinite (0 for sigma) where there
        is no crossing, so that no such change makes the loop unstable; NaN where `status` is not "ok".
    frequency_hz, frequency_sigma_hz
        Frequency at which each was read, and its sigma; NaN where there is none.
    place
        ``interpolated`` by the fitted model within the band of the lines, ``extrapolated`` by it beyond, or ``none``.
    status
        Shape (rows,): "ok", the fit's reason, that the fitted plant would make the loop unstable, or that the lines
        show a larger Ms than the fit (`against_lines`).
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

    names = MARGIN_NAMES
    units = UNITS

    def __repr__(self) -> str:
        if not len(self) or not self.ok[-1]:
            return f"<Margins: {counted(len(self), 'row')}; {self.status[-1] if len(self) else 'none'}>"
        last = zip(self.names, self.value[-1], self.bound()[-1], self.units)
        words = ", ".join(f"{name} {value:.4g} ± {bound:.2g} {unit}".strip() for name, value, bound, unit in last)
        return f"<Margins: {counted(len(self), 'row')}; {words}>"

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which rows are valid, shape (rows,)."""
        return np.asarray(self.status == OK)

    def of(self, name: str) -> Floats:
        """The values of one margin, shape (rows,)."""
        return np.asarray(self.value[:, self.index(name)])

    def index(self, name: str) -> int:
        """Column of a margin; UsageError with the known names where it is not one."""
        if name not in MARGIN_NAMES:
            raise UsageError(
                "unknown-name",
                f"there is no margin {name!r}",
                f"choose from {', '.join(MARGIN_NAMES)}",
                argument="name",
                value=name,
                allowed=list(MARGIN_NAMES),
            )
        return MARGIN_NAMES.index(name)

    def bound(self, probability: float = COVERAGE) -> Floats:
        """Half-width of the interval that covers the truth with this probability, shape (rows, margins).

        Raises
        ------
        UsageError
            If the probability is not between 0 and 1.
        """
        return half_width(self.sigma, probability)

    def parameters(self) -> tuple[Parameters, ...]:
        """For a table in long form: each margin and where it was read, with its place as status."""
        empty, ok = np.full(len(self), np.nan), self.ok
        value = np.stack([self.value, self.frequency_hz], axis=2)
        spread = np.stack([self.sigma, self.frequency_sigma_hz], axis=2)
        covariance = (spread**2)[..., np.newaxis] * np.eye(2)
        tables = []
        for i, (name, unit) in enumerate(zip(MARGIN_NAMES, UNITS)):
            tables.append(
                Parameters(
                    model="margins",
                    names=(name, f"{name}_frequency"),
                    units=(unit, "Hz"),
                    value=value[:, i],
                    covariance=covariance[:, i],
                    status=np.where(ok, self.place[:, i], self.status),
                    epsilon=empty,
                    chi2=empty,
                    dof=empty,
                    sample=self.sample,
                    time_s=self.time_s,
                    schedule=self.schedule,
                )
            )
        return tuple(tables)


def worst(margins: Margins) -> dict[str, float]:
    """The least of each margin over the valid rows (of Ms the largest)."""
    rows = margins.value[margins.ok]
    if not len(rows):
        return {}
    least = {name: float(np.min(rows[:, i])) for i, name in enumerate(MARGIN_NAMES)}
    turn = rows[:, MARGIN_NAMES.index("phase_margin")]
    least["phase_margin"] = float(turn[np.argmin(np.abs(turn))])
    least["peak_sensitivity"] = float(np.max(rows[:, MARGIN_NAMES.index("peak_sensitivity")]))
    return least


def against_lines(margins: Margins, responses: Responses, loop: Loop) -> Margins:
    """Margins without numbers where the lines show a larger Ms than the fit allows.

    A row is contradicted where |S| = 1/|1 + F·G| at a line, less its bound, is above Ms plus its bound: the model omits
    what brings the loop nearer to −1, so all its margins are invalid. The lines' bound covers all lines of a row
    together with 99 %, by Bonferroni: 1 − exp(−c²) = 1 − 0.01/lines.

    Parameters
    ----------
    found
        Margins, a row for each fit.
    responses
        The fitted responses, shapes (rows, lines).
    loop
        The loop with its feedback.

    Returns
    -------
    With the status "contradicted by the lines" and NaN in such rows.
    """
    if not len(margins):
        return margins
    behind = loop.feedback_at(responses.lines.frequency_hz)
    c = float(np.sqrt(np.log(len(responses.lines) / _CHANCE)))
    with np.errstate(invalid="ignore", divide="ignore"):  # of invalid lines
        sensitivity = 1 / (1 + responses.value * behind)
        least = np.abs(sensitivity) - responses.bound(c) * np.abs(behind * sensitivity**2)
        shown = np.where(responses.valid & np.isfinite(least), least, -np.inf).max(axis=1)
        most = (margins.value + margins.bound())[:, MARGIN_NAMES.index("peak_sensitivity")]
        wrong = margins.ok & (shown > most)
    if not wrong.any():
        return margins
    status = margins.status.astype(f"<U{max(len(CONTRADICTED), margins.status.dtype.itemsize // 4)}")
    status[wrong] = CONTRADICTED
    numbers = ("value", "sigma", "frequency_hz", "frequency_sigma_hz")
    kept = {name: np.where(wrong[:, np.newaxis], np.nan, getattr(margins, name)) for name in numbers}
    return replace(margins, **kept, status=status, place=np.where(wrong[:, np.newaxis], NONE, margins.place))


def peak_sensitivity_at_lines(
    responses: Responses, loop: Loop, c: float = CIRCLE_FACTOR
) -> tuple[Floats, Floats, Floats]:
    """The largest |S| at a valid line: a lower bound for Ms, the only margin that lines give without a model.

    Between lines a loop can come nearer to −1 unnoticed, so no crossing is read from them.

    Parameters
    ----------
    responses
        Of the plant; shapes (rows, lines).
    loop
        The loop with its feedback.
    c
        For the bound: the truth at that line is in it with probability 1 − exp(−c²); default: 95 %.

    Returns
    -------
    The largest |S| = 1/|1 + F·G|, its bound by dS/dG = −F·S², and the line's frequency, Hz; each (rows,), NaN where
    no line is valid.

    Examples
    --------
    >>> from livebode import PID, Lines
    >>> lines, ones = Lines.parse("20:60:20", 4000, 200), np.ones((1, 3))
    >>> row, value = np.zeros(1, dtype=int), np.array([[1.0, -0.5, -0.1]], dtype=complex)
    >>> measured = Responses(lines, value, 0.01 * ones, row + np.inf, ones, ones > 0, row, row, row + 0.0, row + 0.0)
    >>> found = peak_sensitivity_at_lines(measured, Loop(feedback=PID(gain=1.0, rate_hz=4000)))
    >>> [x.round(3).item() for x in found]
    [2.0, 0.069, 40.0]
    """
    f = responses.lines.frequency_hz
    behind = loop.feedback_at(f)
    with np.errstate(invalid="ignore", divide="ignore"):  # of invalid lines
        sensitivity = 1 / (1 + responses.value * behind)
    size = np.where(responses.valid, np.abs(sensitivity), -np.inf)
    largest = np.argmax(size, axis=1)
    row = np.arange(len(size))
    known = np.isfinite(size[row, largest])
    bound = responses.bound(c) * np.abs(behind * sensitivity**2)
    return tuple(np.where(known, x, np.nan) for x in (size[row, largest], bound[row, largest], f[largest]))  # type: ignore[return-value]
