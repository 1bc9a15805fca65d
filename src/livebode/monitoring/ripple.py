"""Ripple: torque that repeats with the motor's angle, and a window's evidence with the ripple allowed for."""

from __future__ import annotations

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import needing
from livebode.dataclass import dataclass

_COHERENT = 100.0  # windows in which a ripple may add up as if they were one


@dataclass(frozen=True, eq=False)
class Ripple:
    """Orders of a torque that is not in the logged one, and their size.

    Attributes
    ----------
    cycles_per_m
        Of each order over the schedule, (orders,): 24 a turn of a pulley of 19 mm are 201 a metre.
    amplitude_n_m
        Root mean square of the amplitudes of sine and cosine at the lines, N m (orders,); 0 where it is not known yet.
        It contains what the model omits while the order is on a line, so that this is allowed for as well.
    peak_n_m
        Amplitude of the torque away from the lines, N m (orders,); 0 where it is not known.
    """

    cycles_per_m: Floats = field(default_factory=lambda: np.zeros(0))
    amplitude_n_m: Floats = field(default_factory=lambda: np.zeros(0))
    peak_n_m: Floats = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not self.peak_n_m.size:
            object.__setattr__(self, "peak_n_m", np.zeros(self.cycles_per_m.size))

    def __len__(self) -> int:
        return self.cycles_per_m.size

    @property
    def spread(self) -> Floats:
        """Prior standard deviation of sine and cosine of each order, N m, (2·orders,).

        The power of a hundred windows: while an order is on a line its error is the same in each window, and a sum over
        windows must not count as growing information.
        """
        return np.asarray(np.sqrt(_COHERENT) * np.repeat(self.amplitude_n_m, 2))

    def only(self, chosen: NDArray[np.bool_]) -> Ripple:
        """Some of the orders."""
        return Ripple(self.cycles_per_m[chosen], self.amplitude_n_m[chosen])

    @classmethod
    def of(cls, cycles_per_m: Floats) -> Ripple:
        """Orders of unknown size."""
        return cls(cycles_per_m, np.zeros(cycles_per_m.size))


def torques(cycles_per_m: Floats, position_m: Floats) -> Floats:
    """Cosine and sine of each order along a way, (2·orders, samples).

    >>> torques(np.array([1.0]), np.array([0.0, 0.25])).round(9) + 0.0
    array([[1., 0.],
           [0., 1.]])
    """
    angle = 2 * np.pi * np.outer(cycles_per_m, position_m)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1).reshape(2 * cycles_per_m.size, position_m.size)


def allowed_for(
    score: Floats, information: Floats, e: Floats, cross: Floats, gram: Floats, spread: Floats
) -> tuple[Floats, Floats]:
    """Score and information with a ripple of this spread in each window, by generalised least squares.

    With noise of covariance Σ and a ripple ψ·a, a ~ N(0, R²), the windows' covariance is Σ + ψR²ψᵀ, and by Woodbury
    sᵀ(Σ + ψR²ψᵀ)⁻¹e = ⟨s, e⟩ − ⟨s, ψ⟩R(I + R⟨ψ, ψ⟩R)⁻¹R⟨ψ, e⟩. Where an order meets a line, that line is ignored;
    where it is small or far from the lines, nothing changes. Its phase need not be known.

    Parameters
    ----------
    score, information
        ⟨s, e⟩ and ⟨s, s⟩, (windows, directions), (windows, directions, directions).
    e, cross, gram
        ⟨ψ, e⟩, ⟨s, ψ⟩, ⟨ψ, ψ⟩: (windows, 2·orders), (windows, directions, 2·orders), (windows, 2·orders, 2·orders).
    spread
        R, (2·orders,).
    """
    if not spread.size:
        return score, information
    inner = np.eye(spread.size) + spread[:, np.newaxis] * gram * spread
    left = cross * spread
    gain = np.swapaxes(np.linalg.solve(inner, np.swapaxes(left, 1, 2)), 1, 2)
    return (
        np.asarray(score - np.einsum("wjo,wo->wj", gain, spread * e)),
        np.asarray(information - gain @ np.swapaxes(left, 1, 2)),
    )


def amplitudes(e: Floats, gram: Floats) -> Floats:
    """Root mean square of sine and cosine of each order from ⟨ψ, e⟩ and ⟨ψ, ψ⟩ of healthy windows, (orders,).

    With independent orders E⟨ψi, e⟩² = tr⟨ψi, ψi⟩ + Σj Aj²·‖⟨ψi, ψj⟩‖² (a window does not separate orders that are near
    to each other), summed over the windows and solved for all Aj² ≥ 0.
    """
    with needing("SciPy", "analysis", "a baseline with ripple"):
        from scipy.optimize import nnls
    windows, orders = len(e), e.shape[1] // 2
    power = (e.reshape(windows, orders, 2) ** 2).sum(axis=(0, 2))
    own = gram.reshape(windows, orders, 2, orders, 2)
    noise = np.einsum("woioi->o", own)
    shared = np.einsum("woipj,woipj->op", own, own)
    scale = np.sqrt(np.diagonal(shared))
    squared, _ = nnls(shared / np.outer(scale, scale), (power - noise) / scale)
    return np.asarray(np.sqrt(squared / scale))


def noise_power(power: Floats, gain: Floats, ripple: Ripple) -> Floats:
    """Mean |E|² at each line without the ripple, (lines,).

    A window's weight decreases with the share of its power that the ripple is expected to have.

    Parameters
    ----------
    power
        |E|², (windows, lines).
    gain
        Power of an order of unit amplitude (sine and cosine), (windows, orders, lines).
    """
    if not len(ripple):
        return np.asarray(power.mean(axis=0))
    expected = np.einsum("wol,o->wl", gain, ripple.amplitude_n_m**2)
    typical = np.median(power, axis=0) / np.log(2)
    weight = (typical / (typical + expected)) ** 2
    mean = (weight * (power - expected)).sum(axis=0) / weight.sum(axis=0)
    return np.asarray(np.maximum(mean, typical / 4))
