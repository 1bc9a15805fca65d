"""Fits with which a search for the number of poles begins: without poles, and with those of the stabilisation chart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.fitting.partial_fractions import Structure
from livebode.fitting.pole_kinds import Kind, are_no_modes, fit_of_kind, possible
from livebode.fitting.pole_starts import EVALUATIONS_FIRST
from livebode.fitting.separable import Outputs, SeparatedFit, lost_without, pole_price, solve

INTEGRATORS = 2
"""Integrators at most: from torque to position."""
DIRECT = {"modal": 2, "rational": 1}
"""Direct terms at most."""
ROUNDS_LAST = 8
"""Rounds of reweighting of a result, so that ε converges."""
_RESIDUAL = 2  # pairs outside of the lines
_OUTSIDE = ((2.5, 0.01), (1.3, 0.3), (0.4, 0.01), (0.2, 0.7))  # times the lines, and damping ratios, of their starts
_INCOMPLETE = 0.02  # model error with which modes may be missing


def first_fits(outputs: Outputs, kind: Kind) -> list[SeparatedFit]:
    """One with the poles of the chart; that of "rational" also without poles."""
    none = _without_poles(outputs, kind)
    charted = _charted(outputs, none, kind)
    return [charted] if kind == "modal" else [none, charted]


def _without_poles(outputs: Outputs, kind: Kind) -> SeparatedFit:
    """No poles but integrators, with as many direct terms as the lines allow."""
    for integrators, direct in ((INTEGRATORS, DIRECT[kind]), (1, 1), (1, 0)):
        structure = Structure(len(outputs.measured), integrators=integrators, direct=direct)
        if outputs.enough_for(replace(structure, pairs=1)):
            break
    return solve(outputs, structure, np.empty(0), rounds=ROUNDS_LAST)


def _charted(outputs: Outputs, none: SeparatedFit, kind: Kind) -> SeparatedFit:
    """The best fit with poles of one order of the chart, or `none`."""
    tried = [none]
    for every, stable in zip(outputs.chart.poles, outputs.chart.stable):
        for of in (every[stable], every[every.real < 0]):
            a1, a0 = -2 * of.real, np.abs(of) ** 2
            modes = ~are_no_modes(outputs, a1, a0)
            structure = replace(none.structure, pairs=int(np.count_nonzero(modes)))
            if structure.pairs and outputs.enough_for(structure):
                start = np.stack([a1, a0], axis=1)[modes].ravel()
                tried.append(fit_of_kind(outputs, structure, start, kind, rounds=1, evaluations=0))
    # By the criterion of Akaike: poles that are not fitted yet lower the misfit too little for their price.
    best = min(tried, key=lambda fitted: fitted.misfit + 2 * fitted.structure.size)
    best = _thinned(outputs, fit_of_kind(outputs, best.structure, best.theta, kind))
    return _with_residual(outputs, fit_of_kind(outputs, best.structure, best.theta, kind), kind)


def _price(outputs: Outputs, of: Structure) -> float:
    """Cost of a structure without that of the model's errors."""
    return of.size * float(np.log(outputs.count)) + of.poles * pole_price(outputs.grid.frequency_hz.size, 0.0)


def _thinned(outputs: Outputs, of: SeparatedFit) -> SeparatedFit:
    """Without the modes that lower the misfit by less than their price; the other poles remain where they are.

    Where the model is far from the lines yet, what a mode lowers says little.
    """
    while of.structure.modes and np.max(of.epsilon) < _INCOMPLETE:
        lost = lost_without(outputs, of)[: of.structure.modes]
        i, narrower = int(np.argmin(lost)), replace(of.structure, pairs=of.structure.pairs - 1)
        if lost[i] > _price(outputs, of.structure) - _price(outputs, narrower):
            break
        of = replace(of, structure=narrower, theta=np.delete(of.theta, [2 * i, 2 * i + 1]))
    return of


def _with_residual(outputs: Outputs, of: SeparatedFit, kind: Kind) -> SeparatedFit:
    """With pairs outside of the lines, where they lower the cost."""
    low, high = 2 * np.pi * outputs.grid.frequency_hz[[0, -1]]
    for _ in range(_RESIDUAL if kind == "modal" else 0):
        before = of.structure
        wider = replace(before, pairs=before.pairs + 1, residual=before.residual + 1)
        if not outputs.enough_for(wider):
            break
        rivals = []
        for times, damping in _OUTSIDE:
            omega = times * (high if times > 1 else low)
            start = np.insert(of.theta, 2 * before.pairs, [2 * damping * omega, omega**2])
            rivals.append(fit_of_kind(outputs, wider, start, kind, evaluations=EVALUATIONS_FIRST))
        rivals = [fitted for fitted in rivals if possible(outputs, fitted, kind)]
        best = min(rivals, key=lambda fitted: fitted.cost, default=of)
        if best.cost >= of.cost:
            break
        of = fit_of_kind(outputs, best.structure, best.theta, kind)
    return of
