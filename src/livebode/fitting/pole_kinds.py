"""Which poles a model of a kind may have: modes within the lines, and residual terms outside; fits that keep to it."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.fitting.partial_fractions import Structure, poles_of
from livebode.fitting.separable import EVALUATIONS, Outputs, SeparatedFit, solve

Kind = Literal["modal", "rational"]

BEYOND = 1.5
"""Times the highest line, or the lowest line over it: a mode outside is a residual term."""
ROUNDS_SEARCH = 2
"""Rounds of reweighting of a search, which only compares costs; the result needs more, so that ε converges."""
_NARROW = 0.1  # of the spacing of lines, for the half-width of a mode
_SMOOTH = 0.7  # damping ratio of a pole between the lines that is too smooth to be a mode
_FAR = 30.0  # times the highest line, or the lowest line over it: a pole outside is an integrator or a direct term
_EARLIEST_TICKS, _LATEST_TICKS, _LATEST_S = 2.0, 5.0, 0.02


def degree(of: SeparatedFit, kind: Kind) -> int:
    """Number of modes, or of poles without integrators."""
    return of.structure.modes if kind == "modal" else of.structure.poles


def fit_of_kind(
    outputs: Outputs, structure: Structure, start: Floats, kind: Kind, *, rounds: int = ROUNDS_SEARCH,
    evaluations: int = EVALUATIONS,
) -> SeparatedFit:  # fmt: skip
    """Fitted from a start; pairs of "modal" that are no modes any more are residual terms."""
    of = solve(outputs, structure, start, rounds=rounds, evaluations=evaluations)
    if kind != "modal":
        return of
    a1, a0 = of.structure.pairs_of(of.theta).T
    outside, (_, high) = are_no_modes(outputs, a1, a0), 2 * np.pi * outputs.grid.frequency_hz[[0, -1]]
    # Above half of the rate a pole would be an alias of one between the lines.
    alias = (outputs.grid.hold != "none") & (a0 - a1**2 / 4 > (np.pi * outputs.grid.rate_hz) ** 2)
    far = outside & (alias | (np.abs(a0) > (_FAR * high) ** 2))
    order = np.concatenate([np.flatnonzero(~outside), np.flatnonzero(outside & ~far)])
    pairs, residual = order.size, int(np.count_nonzero(outside & ~far))
    if pairs == of.structure.pairs and residual == of.structure.residual:
        return of
    sorted_ = replace(of.structure, pairs=pairs, residual=residual)
    chosen = (2 * order[:, np.newaxis] + [0, 1]).ravel()
    theta = np.concatenate([of.theta[chosen], of.theta[2 * of.structure.pairs :]])
    if far.any():
        return solve(outputs, sorted_, theta, rounds=rounds, evaluations=evaluations)
    linear = np.concatenate([of.linear[:, chosen], of.linear[:, 2 * pairs :]], axis=1)
    return replace(of, structure=sorted_, theta=theta, linear=linear)


def are_no_modes(outputs: Outputs, a1: Floats, a0: Floats) -> NDArray[np.bool_]:
    """Which pairs are no modes: outside of the lines, not damped, or too smooth between the lines."""
    low, high = 2 * np.pi * outputs.grid.frequency_hz[[0, -1]]
    within = (a0 > (low / BEYOND) ** 2) & (a0 < (high * BEYOND) ** 2)
    # A mode much narrower than the spacing of lines may by noise have a damping a little below zero.
    damped = a1 > -_NARROW * 4 * np.pi * np.min(np.diff(outputs.grid.frequency_hz), initial=np.inf)
    return np.asarray(~within | ~damped | (a1 > 2 * _SMOOTH * np.sqrt(np.abs(a0))))


def possible(outputs: Outputs, of: SeparatedFit, kind: Kind) -> bool:
    """Whether its poles are of the kind, and its delays are such that logging or a sensor can cause."""
    delays = of.structure.delays_of(of.theta) * outputs.grid.rate_hz
    latest = max(_LATEST_TICKS, _LATEST_S * outputs.grid.rate_hz)
    if (delays < -_EARLIEST_TICKS).any() or (delays > latest).any():
        return False
    ends = 2 * np.pi * outputs.grid.frequency_hz[[0, -1]]
    if kind == "rational":
        size = np.abs(poles_of(of.structure, of.theta))
        return bool(((size > ends[0] / _FAR) & (size < ends[1] * _FAR)).all())
    a1, a0 = of.structure.pairs_of(of.theta).T
    outside = are_no_modes(outputs, a1, a0)
    return bool(not outside[: of.structure.modes].any() and outside[of.structure.modes :].all())
