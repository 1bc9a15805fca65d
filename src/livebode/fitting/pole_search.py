"""Number of poles that responses show: poles are added where they explain most, and needless terms removed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Literal

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.fitting.partial_fractions import PartialFractions, Structure, poles_of
from livebode.fitting.separable import Outputs, SeparatedFit, left_over, solve, stacked

Kind = Literal["modal", "rational"]

ORDER_MAX = {"modal": 20, "rational": 40}
_INTEGRATORS = 2  # at most: from torque to position
_DIRECT = {"modal": 2, "rational": 1}
_IN_VAIN = {"modal": 2, "rational": 4}  # orders in a row without a lower cost end the search
_TRIED = 3  # starts for each added pole
_PEAKS, _WIDTHS = 24, (0.3, 1.0, 4.0)  # lines with the largest residuals; half-widths over the spacing of lines
_SPREAD, _DAMPINGS = 30, (0.02, 0.1, 0.4)
_BEYOND = 1.5  # times the highest line, or the lowest line over it: a mode outside is a residual term
_NARROW = 0.1  # of the spacing of lines, for the half-width of a mode
_FAR = 30.0  # times the highest line, or the lowest line over it: a pole outside is an integrator or a direct term
_EVALUATIONS_FIRST = 12  # of a start, before the best one is continued
_ROUNDS_SEARCH, _ROUNDS_LAST = 2, 8  # of reweighting: a search only compares costs, the result needs ε to converge
_ROUGH = 0.1  # model error with which a delay cannot be told from missing poles
_EARLIEST_TICKS, _LATEST_TICKS, _LATEST_S = 2.0, 5.0, 0.02


def search(outputs: Outputs, kind: Kind, order: int | None = None) -> list[SeparatedFit]:
    """The best fits, by increasing cost; of one order only where it is specified.

    The order of "modal" is the number of modes, that of "rational" the number of poles without integrators. A search
    ends where two further orders in a row do not lower the cost.
    """
    grown: dict[int, SeparatedFit] = {}
    for degree in range((ORDER_MAX[kind] if order is None else order) + 1):
        begun = [
            fitted
            for step in (1, 2)
            if degree - step in grown
            for fitted in _grown(outputs, grown[degree - step], kind, step)
        ]
        begun = [fitted for fitted in begun if possible(outputs, fitted, kind)] or begun
        if degree == 0:
            begun = [_begun(outputs, kind)]
        if not begun:
            continue
        best = min(begun, key=lambda fitted: fitted.cost)
        best = solve(outputs, best.structure, best.theta, rounds=_ROUNDS_SEARCH)
        grown[degree] = min([best, *_delayed(outputs, best)], key=lambda fitted: fitted.cost)
        if order is None and degree - min(grown, key=lambda i: grown[i].cost) >= _IN_VAIN[kind]:
            break
    if order is not None:
        return [_reduced(outputs, grown[order], kind, fixed=True)] if order in grown else []
    return _finished(outputs, sorted(grown.values(), key=lambda fitted: fitted.cost), kind)


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
            fitted = solve(outputs, alike, fitted.theta[: alike.nonlinear], rounds=_ROUNDS_SEARCH)
            if fitted.cost >= best.cost:
                finished.append(fitted)
                continue
        finished.append(_reduced(outputs, fitted, kind))
    return sorted((fitted for fitted in finished if possible(outputs, fitted, kind)), key=lambda fitted: fitted.cost)


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
    # A mode much narrower than the spacing of lines may by noise have a damping a little below zero.
    damped = a1 > -_NARROW * 4 * np.pi * np.min(np.diff(outputs.grid.frequency_hz), initial=np.inf)
    between = (a0 > (ends[0] / _BEYOND) ** 2) & (a0 < (ends[1] * _BEYOND) ** 2)
    return bool((damped & (a1**2 < 4 * a0) & between).all())


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
        starts = [
            np.concatenate([of.theta[: 2 * before.pairs], pair, of.theta[2 * before.pairs :]])
            for pair in _pairs_to_try(outputs, of)
        ]
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
            yield solve(outputs, wider, start, rounds=1, evaluations=_EVALUATIONS_FIRST)


def _reduced(outputs: Outputs, of: SeparatedFit, kind: Kind, *, fixed: bool = False) -> SeparatedFit:
    """With the weights of noise and ε, and without the terms that do not lower the cost."""
    best = solve(outputs, of.structure, of.theta, rounds=_ROUNDS_LAST)
    while True:
        rivals = [
            solve(outputs, structure, start, rounds=_ROUNDS_SEARCH)
            for structure, start in reduced_structures(best, kind, fixed=fixed)
            if outputs.enough_for(structure)
        ]
        rivals = [fitted for fitted in rivals if possible(outputs, fitted, kind)]
        better = min(rivals, key=lambda fitted: fitted.cost, default=best)
        if better.cost >= best.cost and possible(outputs, best, kind):
            return best
        if better is best:
            return replace(best, cost=np.inf)
        best = solve(outputs, better.structure, better.theta, rounds=_ROUNDS_LAST)


def reduced_structures(of: SeparatedFit, kind: Kind, *, fixed: bool) -> Iterator[tuple[Structure, Floats]]:
    """Structures with a term less, and a start for each; `fixed`: with as many poles."""
    structure, theta = of.structure, of.theta
    if structure.integrators and structure.poles + structure.integrators + structure.direct > 1:
        yield replace(structure, integrators=structure.integrators - 1), theta
    if structure.direct and structure.poles + structure.integrators + structure.direct > 1:
        yield replace(structure, direct=structure.direct - 1), theta
    if structure.delays:
        yield replace(structure, delays=False), theta[: structure.poles]
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
