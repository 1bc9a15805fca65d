"""Margins of the loop at each fit, with bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import OK, Parameters, RowArrays, UsageError, counted, half_width
from livebode.language import Message

WORDS = {
    "gain_margin": Message("gain may rise by"),
    "gain_reduction": Message("gain may fall by"),
    "phase_margin": Message("phase margin"),
    "delay_margin": Message("delay margin"),
    "peak_sensitivity": Message("peak sensitivity Ms"),
    "bandwidth": Message("bandwidth"),
}
"""The margins, with their names for people."""
NAMES = tuple(WORDS)
UNITS = ("dB", "dB", Message("deg"), "ms", "", "Hz")
UNSTABLE = Message("unstable by the fit")
CONTRADICTED = Message("contradicted by the lines")
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

    names = NAMES
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
        if name not in NAMES:
            raise UsageError(
                "unknown-name",
                f"there is no margin {name!r}",
                f"choose from {', '.join(NAMES)}",
                argument="name",
                value=name,
                allowed=list(NAMES),
            )
        return NAMES.index(name)

    def bound(self, probability: float = 0.95) -> Floats:
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
        found = []
        for i, (name, unit) in enumerate(zip(NAMES, UNITS)):
            found.append(
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
        return tuple(found)
