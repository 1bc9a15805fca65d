"""Amplitudes of orders as values that are nearly normal, whatever the speeds of a section were."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from livebode.arrays import Floats
from livebode.monitoring.torque_model import OrderWindows
from livebode.motion import Shaft

TOGETHER_MIN = 4  # orders of a shaft, from which on they are also judged together
_BINS = 48
_BIN_MIN = 20  # windows
_WINDOWS_MIN = 3  # of a section, whose scatter shows what is no order


@dataclass(frozen=True, eq=False)
class TorqueNoise:
    """Power of a window's complex amplitude without any order, over the frequency; (frequencies,) each."""

    frequency_hz: Floats
    power: Floats

    @classmethod
    def of(cls, windows: Sequence[OrderWindows]) -> TorqueNoise:
        """From windows of the healthy axis: the median over all orders, of which few are there, in bins."""
        value = np.concatenate([window.value.ravel() for window in windows])
        f = np.concatenate([window.frequency_hz.ravel() for window in windows])
        known = np.isfinite(value) & (f > 0)
        f, square = f[known], np.abs(value[known]) ** 2
        order = np.argsort(f, kind="stable")
        parts = np.array_split(order, max(1, min(_BINS, f.size // _BIN_MIN)))
        return cls(
            np.array([np.median(f[part]) for part in parts]),
            np.array([np.median(square[part]) for part in parts]) / np.log(2),
        )

    def at(self, frequency_hz: Floats) -> Floats:
        """Power at these frequencies."""
        return np.exp(np.interp(frequency_hz, self.frequency_hz, np.log(self.power)))


def powers(windows: Sequence[OrderWindows], noise: TorqueNoise) -> tuple[Floats, Floats]:
    """|amplitude|² of each order's mean over the windows, and what noise gives; (orders,) each.

    Windows are weighted by the noise at their frequencies. An order of the shaft has one phase in all windows of a
    section. What is in a few of them only, such as the excitation near a line that the axis passes, scatters, and
    counts as noise. NaN and infinite where fewer than three windows show an order.
    """
    square, own = [], []
    for window in windows:
        value, seen = np.nan_to_num(window.value), np.isfinite(window.value)
        weight = np.where(seen, 1 / noise.at(window.frequency_hz), 0.0)
        count, total = seen.sum(axis=0), np.maximum(weight.sum(axis=0), np.finfo(float).tiny)
        share = weight / total
        mean = np.sum(share * value, axis=0)
        scatter = np.sum(share**2 * np.abs(value - mean) ** 2, axis=0) * count / np.maximum(count - 1, 1)
        known = count >= _WINDOWS_MIN
        square.append(np.where(known, np.abs(mean) ** 2, np.nan))
        own.append(np.where(known, np.maximum(1 / total, scatter), np.inf))
    return np.concatenate(square), np.concatenate(own)


def normal_values(square: Floats, own: Floats, true: Floats, usual: Floats) -> Floats:
    """Values of orders whose scatter hardly depends on the speeds and the number of windows, (orders,).

    The cube root of |amplitude|², a χ² of two degrees of freedom, is nearly normal whether the order is seen or not
    (Wilson and Hilferty, PNAS 17, 1931; Abdel-Aty, Biometrika 41, 1954). It is scaled to the usual noise: by nothing
    for an order that is well above the noise, so that its amplitude remains true.

    Parameters
    ----------
    square, own
        Of `powers`.
    true, usual
        Square of the amplitude of the healthy axis, and the usual noise.
    """
    with np.errstate(invalid="ignore"):
        return np.asarray(np.cbrt(square * (true + usual) / (true + own)))


def together(square: Floats, own: Floats, true: Floats, shafts: Sequence[Shaft]) -> Floats:
    """For each shaft the cube root of the mean of its orders' powers, relative to the healthy ones, (shafts,).

    A local defect, such as a tooth, has many orders, and each of them is small. NaN where fewer than half are known.
    """
    with np.errstate(invalid="ignore"):
        share = square / (true + own)
    edges = np.cumsum([len(shaft.orders) for shaft in shafts])[:-1]
    return np.array([_mean_share(part) for part in np.split(share, edges)])


def _mean_share(share: Floats) -> float:
    known = share[np.isfinite(share)]
    if known.size < max(TOGETHER_MIN, share.size / 2):
        return np.nan
    # With the scatter of as many orders as the shaft has.
    mean = 1 - 1 / (9 * known.size)
    return float(mean + (np.cbrt(known.mean()) - mean) * np.sqrt(known.size / share.size))
