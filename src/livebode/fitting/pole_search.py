"""Number of poles that responses show: poles are added where they explain most, and needless terms removed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.fitting.partial_fractions import PartialFractions, Structure, poles_of
from livebode.fitting.separable import (
    EVALUATIONS,
    Outputs,
    SeparatedFit,
    left_over,
    lost_without,
    pole_price,
    solve,
    stacked,
)

Kind = Literal["modal", "rational"]

Grown = dict[int, SeparatedFit]
"""The best fit of each order."""

ORDER_MAX = {"modal": 30, "rational": 40}
_INTEGRATORS = 2  # at most: from torque to position
_DIRECT = {"modal": 2, "rational": 1}
_IN_VAIN = {"modal": 2, "rational": 4}  # orders in a row without a lower cost end the search
_TRIED = 3  # starts for each added pole
_PEAKS, _WIDTHS = 24, (0.3, 1.0, 4.0)  # lines with the largest residuals; half-widths over the spacing of lines
_SPREAD, _DAMPINGS = 30, (0.02, 0.1, 0.4)
_BEYOND = 1.5  # times the highest line, or the lowest line over it: a mode outside is a residual term
_NARROW = 0.1  # of the spacing of lines, for the half-width of a mode
_SMOOTH = 0.7  # damping ratio of a pole between the lines that is too smooth to be a mode
_RESIDUAL = 2  # pairs outside of the lines
_OUTSIDE = ((2.5, 0.01), (1.3, 0.3), (0.4, 0.01), (0.2, 0.7))  # times the lines, and damping ratios, of their starts
_WEAKEST = 2  # modes to try a fit without
_FAR = 30.0  # times the highest line, or the lowest line over it: a pole outside is an integrator or a direct term
_EVALUATIONS_FIRST = 12  # of a start, before the best one is continued
_ROUNDS_SEARCH, _ROUNDS_LAST = 2, 8  # of reweighting: a search only compares costs, the result needs ε to converge
_INCOMPLETE = 0.02  # model error with which modes may be missing
_ROUGH = 0.1  # model error with which a delay cannot be told from missing poles
_EARLIEST_TICKS, _LATEST_TICKS, _LATEST_S = 2.0, 5.0, 0.02


def search(outputs: Outputs, kind: Kind, order: int | None = None) -> list[SeparatedFit]:
    """The best fits, by increasing cost; of one order only where it is specified.

    The order of "modal" is the number of modes, that of "rational" the number of poles without integrators. A search
    begins with the poles of the stabilisation chart; that of "rational" also without poles. From there orders are
    added until some in a row do not lower the cost, and modes removed as long as that lowers it.
    """
    last = ORDER_MAX[kind] if order is None else order
    in_vain = _IN_VAIN[kind] if order is None else last
    grown: Grown = {}
    for begun in _starts(outputs, kind):
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


def degree(of: SeparatedFit, kind: Kind) -> int:
    """Number of modes, or of poles without integrators."""
    return of.structure.modes if kind == "modal" else of.structure.poles


def _charted(outputs: Outputs, none: SeparatedFit, kind: Kind) -> SeparatedFit:
    """The best fit with poles of one order of the chart, or `none`."""
    tried = [none]
    for every, stable in zip(outputs.chart.poles, outputs.chart.stable):
        for of in (every[stable], every[every.real < 0]):
            a1, a0 = -2 * of.real, np.abs(of) ** 2
            modes = ~_outside(outputs, a1, a0)
            structure = replace(none.structure, pairs=int(np.count_nonzero(modes)))
            if structure.pairs and outputs.enough_for(structure):
                start = np.stack([a1, a0], axis=1)[modes].ravel()
                tried.append(_fit(outputs, structure, start, kind, rounds=1, evaluations=0))
    # By the criterion of Akaike: poles that are not fitted yet lower the misfit too little for their price.
    best = min(tried, key=lambda fitted: fitted.misfit + 2 * fitted.structure.size)
    best = _thinned(outputs, _fit(outputs, best.structure, best.theta, kind))
    return _with_residual(outputs, _fit(outputs, best.structure, best.theta, kind), kind)


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
            rivals.append(_fit(outputs, wider, start, kind, evaluations=_EVALUATIONS_FIRST))
        rivals = [fitted for fitted in rivals if possible(outputs, fitted, kind)]
        best = min(rivals, key=lambda fitted: fitted.cost, default=of)
        if best.cost >= of.cost:
            break
        of = _fit(outputs, best.structure, best.theta, kind)
    return of


def _starts(outputs: Outputs, kind: Kind) -> list[SeparatedFit]:
    none = _begun(outputs, kind)
    charted = _charted(outputs, none, kind)
    return [charted] if kind == "modal" else [none, charted]


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
            for fitted in _grown(outputs, grown[order - step], kind, step)
        ]  # fmt: skip
        begun = [fitted for fitted in begun if possible(outputs, fitted, kind)] or begun
        if begun:
            best = min(begun, key=_cost)
            best = _fit(outputs, best.structure, best.theta, kind)
            for fitted in (best, *_delayed(outputs, best)):
                _keep(grown, fitted, kind)
        if order - min(grown, key=lambda i: grown[i].cost) >= in_vain:
            break


def _remove(outputs: Outputs, grown: Grown, last: int) -> None:
    """Smaller orders of "modal", as long as that lowers the cost or there are more modes than `last` > 0."""
    of = min(grown.values(), key=_cost)
    while of.structure.modes:
        smaller = [_fit(outputs, *start, "modal") for start in _weakest(outputs, of)]
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
            gain = (_INTEGRATORS + _DIRECT[kind] + 1) * len(outputs.measured) * np.log(outputs.count)
            if fitted.cost > best.cost + gain:
                break
            alike = replace(
                fitted.structure, integrators=best.structure.integrators, direct=best.structure.direct,
                delays=best.structure.delays and fitted.structure.delays,
            )  # fmt: skip
            same = _fit(outputs, alike, fitted.theta[: alike.nonlinear], kind)
            if same.cost >= best.cost and degree(same, kind) >= degree(best, kind):
                finished.append(same)
                continue
        finished.append(_reduced(outputs, fitted, kind))
    return sorted((fitted for fitted in finished if possible(outputs, fitted, kind)), key=lambda fitted: fitted.cost)


def _fit(
    outputs: Outputs, structure: Structure, start: Floats, kind: Kind, *, rounds: int = _ROUNDS_SEARCH,
    evaluations: int = EVALUATIONS,
) -> SeparatedFit:  # fmt: skip
    """Fitted from a start; pairs of "modal" that are no modes any more are residual terms."""
    of = solve(outputs, structure, start, rounds=rounds, evaluations=evaluations)
    if kind != "modal":
        return of
    a1, a0 = of.structure.pairs_of(of.theta).T
    outside, (_, high) = _outside(outputs, a1, a0), 2 * np.pi * outputs.grid.frequency_hz[[0, -1]]
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


def _outside(outputs: Outputs, a1: Floats, a0: Floats) -> NDArray[np.bool_]:
    """Which pairs are no modes: outside of the lines, not damped, or too smooth between the lines."""
    low, high = 2 * np.pi * outputs.grid.frequency_hz[[0, -1]]
    within = (a0 > (low / _BEYOND) ** 2) & (a0 < (high * _BEYOND) ** 2)
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
    outside = _outside(outputs, a1, a0)
    return bool(not outside[: of.structure.modes].any() and outside[of.structure.modes :].all())


def _delayed(outputs: Outputs, of: SeparatedFit) -> list[SeparatedFit]:
    """This model with a delay of each output."""
    wider = replace(of.structure, delays=True)
    if of.structure.delays or np.max(of.epsilon) > _ROUGH or not outputs.enough_for(wider):
        return []
    start = np.append(of.theta, np.zeros(wider.outputs))
    return [solve(outputs, wider, start, rounds=_ROUNDS_SEARCH)]


def _begun(outputs: Outputs, kind: Kind) -> SeparatedFit:
    """No poles but integrators, with as many direct terms as the lines allow."""
    for integrators, direct in ((_INTEGRATORS, _DIRECT[kind]), (1, 1), (1, 0)):
        structure = Structure(len(outputs.measured), integrators=integrators, direct=direct)
        if outputs.enough_for(replace(structure, pairs=1)):
            break
    return solve(outputs, structure, np.empty(0), rounds=_ROUNDS_LAST)


def _grown(outputs: Outputs, of: SeparatedFit, kind: Kind, step: int) -> Iterator[SeparatedFit]:
    """Fits with one more order of poles: a pair is an order of "modal" and two of "rational"."""
    before = of.structure
    if kind == "modal" or step == 2:
        if kind == "modal" and step == 2:
            return
        wider = replace(before, pairs=before.pairs + 1)
        starts = [np.concatenate([pair, of.theta]) for pair in _pairs_to_try(outputs, of)]
    elif before.single:
        wider = replace(before, pairs=before.pairs + 1, single=0)
        own, index = of.theta[before.poles - 1], before.poles
        starts = [
            np.concatenate([of.theta[: index - 1], [own + other, own * other], of.theta[index:]])
            for other in _reals_to_try(outputs, of)
        ]
    else:
        wider = replace(before, single=1)
        index = before.poles
        starts = [np.concatenate([of.theta[:index], [a], of.theta[index:]]) for a in _reals_to_try(outputs, of)]
    if outputs.enough_for(wider):
        for start in starts:
            yield _fit(outputs, wider, start, kind, rounds=1, evaluations=_EVALUATIONS_FIRST)


def _reduced(outputs: Outputs, of: SeparatedFit, kind: Kind, *, fixed: bool = False) -> SeparatedFit:
    """With the weights of noise and ε, and without the terms that do not lower the cost."""
    best = _fit(outputs, of.structure, of.theta, kind, rounds=_ROUNDS_LAST)
    while True:
        rivals = [
            _fit(outputs, structure, start, kind)
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
        best = _fit(outputs, better.structure, better.theta, kind, rounds=_ROUNDS_LAST)


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


def _pairs_to_try(outputs: Outputs, of: SeparatedFit) -> Floats:
    """a1 and a0 of the pairs that would lower chi² most to first order, (starts, 2)."""
    residual, _ = left_over(outputs, of)
    f = outputs.grid.frequency_hz
    power = np.sum(residual[:, : f.size] ** 2 + residual[:, f.size :] ** 2, axis=0)
    peaks = np.argsort(-power)[:_PEAKS]
    spacing = np.gradient(f)[peaks] if f.size > 1 else f[peaks]
    narrow = [(f[peaks], width * spacing / f[peaks]) for width in _WIDTHS]
    spread = np.geomspace(f[0] / _BEYOND, f[-1] * _BEYOND, _SPREAD)
    wide = [(spread, np.full(_SPREAD, damping)) for damping in _DAMPINGS]
    frequency, damping = (np.concatenate(part) for part in zip(*narrow, *wide))
    omega, damping = 2 * np.pi * frequency, np.clip(damping, 1e-4, 0.7)
    tried = np.stack([2 * damping * omega, omega**2], axis=1)
    return _best(outputs, of, tried, lambda shapes: shapes.pairs(tried[:, 0], tried[:, 1]))


def _reals_to_try(outputs: Outputs, of: SeparatedFit) -> Floats:
    """a of the real poles that would lower chi² most to first order, (starts,)."""
    f = outputs.grid.frequency_hz
    tried = 2 * np.pi * np.geomspace(f[0] / 10, f[-1] * 3, _SPREAD)
    return _best(outputs, of, tried, lambda shapes: shapes.real(tried)[:, np.newaxis])


def _best(
    outputs: Outputs, of: SeparatedFit, tried: Floats, columns_of: Callable[[PartialFractions], Complex]
) -> Floats:
    """Rows of `tried` whose columns (tried, columns, lines) explain most of the residuals, far enough apart."""
    residual, bases = left_over(outputs, of)
    columns = columns_of(PartialFractions(of.structure, outputs.grid, outputs.unit))
    gain = np.zeros(len(tried))
    for weight, right, basis in zip(of.weight, residual, bases):
        both = np.moveaxis(stacked(np.moveaxis(weight * columns, -1, 0)), 0, -1)
        both = both - (both @ basis) @ basis.T
        both /= np.linalg.norm(both, axis=-1, keepdims=True) + 1e-300
        across, square = both @ right, both @ both.swapaxes(1, 2)
        square = square + 1e-9 * np.eye(square.shape[-1])
        gain += np.einsum("tc,tc->t", across, np.linalg.solve(square, across[..., np.newaxis])[..., 0])
    chosen: list[int] = []
    for i in np.argsort(-gain):
        size = np.sqrt(np.abs(np.atleast_2d(tried.T)[-1])) if tried.ndim == 2 else tried
        if all(abs(np.log(size[i] / size[j])) > 0.02 for j in chosen):
            chosen.append(int(i))
        if len(chosen) == _TRIED:
            break
    return np.asarray(tried[chosen])
