"""Number of poles that responses show: poles are added where they explain most, and needless terms removed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from livebode.arrays import Floats
from livebode.fitting.first_fits import DIRECT, INTEGRATORS, ROUNDS_LAST, first_fits
from livebode.fitting.partial_fractions import Structure
from livebode.fitting.pole_kinds import ROUNDS_SEARCH, Kind, degree, fit_of_kind, possible
from livebode.fitting.pole_starts import with_another_order
from livebode.fitting.separable import Outputs, SeparatedFit, lost_without, solve

Grown = dict[int, SeparatedFit]
"""The best fit of each order."""

ORDER_MAX = {"modal": 30, "rational": 40}
_IN_VAIN = {"modal": 2, "rational": 4}  # orders in a row without a lower cost end the search
_WEAKEST = 2  # modes to try a fit without
_ROUGH = 0.1  # model error with which a delay cannot be told from missing poles


def search(outputs: Outputs, kind: Kind, order: int | None = None) -> list[SeparatedFit]:
    """The best fits, by increasing cost; of one order only where it is specified.

    The order of "modal" is the number of modes, that of "rational" the number of poles without integrators. A search
    begins with the poles of the stabilisation chart; that of "rational" also without poles. From there orders are
    added until some in a row do not lower the cost, and modes removed as long as that lowers it.
    """
    last = ORDER_MAX[kind] if order is None else order
    in_vain = _IN_VAIN[kind] if order is None else last
    grown: Grown = {}
    for begun in first_fits(outputs, kind):
        branch = {degree(begun, kind): begun}
        if kind == "modal":
            _remove(outputs, branch, last)
        _add(outputs, branch, kind, last, in_vain)
        if kind == "modal" and order is None:
            _remove(outputs, branch, 0)
        for fitted in branch.values():
            _keep(grown, fitted, kind)
    if order is not None:
        return [_reduced(outputs, grown[order], kind, fixed=True)] if order in grown else []
    return _finished(outputs, sorted(grown.values(), key=_cost), kind)


def _cost(of: SeparatedFit) -> float:
    return of.cost


def _keep(grown: Grown, fitted: SeparatedFit, kind: Kind) -> None:
    """The better one of each order."""
    at = degree(fitted, kind)
    if at not in grown or fitted.cost < grown[at].cost:
        grown[at] = fitted


def _add(outputs: Outputs, grown: Grown, kind: Kind, last: int, in_vain: int) -> None:
    """Larger orders, until as many in a row do not lower the cost."""
    for order in range(max(grown) + 1, last + 1):
        begun = [
            fitted for step in (1, 2) if order - step in grown
            for fitted in with_another_order(outputs, grown[order - step], kind, step)
        ]  # fmt: skip
        begun = [fitted for fitted in begun if possible(outputs, fitted, kind)] or begun
        if begun:
            best = min(begun, key=_cost)
            best = fit_of_kind(outputs, best.structure, best.theta, kind)
            for fitted in (best, *_delayed(outputs, best)):
                _keep(grown, fitted, kind)
        if order - min(grown, key=lambda i: grown[i].cost) >= in_vain:
            break


def _remove(outputs: Outputs, grown: Grown, last: int) -> None:
    """Smaller orders of "modal", as long as that lowers the cost or there are more modes than `last` > 0."""
    of = min(grown.values(), key=_cost)
    while of.structure.modes:
        smaller = [fit_of_kind(outputs, *start, "modal") for start in _weakest(outputs, of)]
        best = min(smaller, key=_cost)
        _keep(grown, best, "modal")
        if best.cost >= of.cost and not 0 < last < of.structure.modes:
            break
        of = best


def _weakest(outputs: Outputs, of: SeparatedFit) -> Iterator[tuple[Structure, Floats]]:
    """Without one of the modes that explain least."""
    structure = of.structure
    for i in np.argsort(lost_without(outputs, of)[: structure.modes])[:_WEAKEST]:
        yield replace(structure, pairs=structure.pairs - 1), np.delete(of.theta, [2 * i, 2 * i + 1])


def _finished(outputs: Outputs, grown: list[SeparatedFit], kind: Kind) -> list[SeparatedFit]:
    """The best one reduced, and those that may become better with the same terms."""
    finished: list[SeparatedFit] = []
    for fitted in grown:
        best = min(finished, key=lambda other: other.cost, default=None)
        if best is not None:
            # What a reduction can gain is known: an order that is worse by more cannot become the best.
            gain = (INTEGRATORS + DIRECT[kind] + 1) * len(outputs.measured) * np.log(outputs.count)
            if fitted.cost > best.cost + gain:
                break
            alike = replace(
                fitted.structure, integrators=best.structure.integrators, direct=best.structure.direct,
                delays=best.structure.delays and fitted.structure.delays,
            )  # fmt: skip
            same = fit_of_kind(outputs, alike, fitted.theta[: alike.nonlinear], kind)
            if same.cost >= best.cost and degree(same, kind) >= degree(best, kind):
                finished.append(same)
                continue
        finished.append(_reduced(outputs, fitted, kind))
    return sorted((fitted for fitted in finished if possible(outputs, fitted, kind)), key=lambda fitted: fitted.cost)


def _delayed(outputs: Outputs, of: SeparatedFit) -> list[SeparatedFit]:
    """This model with a delay of each output."""
    wider = replace(of.structure, delays=True)
    if of.structure.delays or np.max(of.epsilon) > _ROUGH or not outputs.enough_for(wider):
        return []
    start = np.append(of.theta, np.zeros(wider.outputs))
    return [solve(outputs, wider, start, rounds=ROUNDS_SEARCH)]


def _reduced(outputs: Outputs, of: SeparatedFit, kind: Kind, *, fixed: bool = False) -> SeparatedFit:
    """With the weights of noise and ε, and without the terms that do not lower the cost."""
    best = fit_of_kind(outputs, of.structure, of.theta, kind, rounds=ROUNDS_LAST)
    while True:
        rivals = [
            fit_of_kind(outputs, structure, start, kind)
            for structure, start in chain(
                reduced_structures(best, kind, fixed=fixed),
                _weakest(outputs, best) if kind == "modal" and not fixed else (),
            )
            if outputs.enough_for(structure)
        ]
        rivals = [fitted for fitted in rivals if possible(outputs, fitted, kind)]
        better = min(rivals, key=lambda fitted: fitted.cost, default=best)
        if better.cost >= best.cost and possible(outputs, best, kind):
            return best
        if better is best:
            return replace(best, cost=np.inf)
        best = fit_of_kind(outputs, better.structure, better.theta, kind, rounds=ROUNDS_LAST)


def reduced_structures(of: SeparatedFit, kind: Kind, *, fixed: bool) -> Iterator[tuple[Structure, Floats]]:
    """Structures with a term less, and a start for each; `fixed`: with as many poles."""
    structure, theta = of.structure, of.theta
    if structure.integrators and structure.poles + structure.integrators + structure.direct > 1:
        yield replace(structure, integrators=structure.integrators - 1), theta
    if structure.direct and structure.poles + structure.integrators + structure.direct > 1:
        yield replace(structure, direct=structure.direct - 1), theta
    if structure.delays:
        yield replace(structure, delays=False), theta[: structure.poles]
    for i in range(structure.modes, structure.pairs):
        narrower = replace(structure, pairs=structure.pairs - 1, residual=structure.residual - 1)
        yield narrower, np.delete(theta, [2 * i, 2 * i + 1])
    for i in range(structure.pairs if kind == "rational" and not fixed else 0):
        yield replace(structure, pairs=structure.pairs - 1), np.delete(theta, [2 * i, 2 * i + 1])
    if structure.single and not fixed:
        yield replace(structure, single=0), np.delete(theta, structure.poles - 1)
