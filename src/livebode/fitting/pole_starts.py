"""Starts of one more order of poles: where they explain most of the residuals of a fit, to first order."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.fitting.partial_fractions import PartialFractions
from livebode.fitting.pole_kinds import BEYOND, Kind, fit_of_kind
from livebode.fitting.separable import Outputs, SeparatedFit, left_over, stacked

EVALUATIONS_FIRST = 12
"""Evaluations of a start, before the best one is continued."""
_TRIED = 3  # starts for each added pole
_PEAKS, _WIDTHS = 24, (0.3, 1.0, 4.0)  # lines with the largest residuals; half-widths over the spacing of lines
_SPREAD, _DAMPINGS = 30, (0.02, 0.1, 0.4)


def with_another_order(outputs: Outputs, of: SeparatedFit, kind: Kind, step: int) -> Iterator[SeparatedFit]:
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
            yield fit_of_kind(outputs, wider, start, kind, rounds=1, evaluations=EVALUATIONS_FIRST)


def _pairs_to_try(outputs: Outputs, of: SeparatedFit) -> Floats:
    """a1 and a0 of the pairs that would lower chi² most to first order, (starts, 2)."""
    residual, _ = left_over(outputs, of)
    f = outputs.grid.frequency_hz
    power = np.sum(residual[:, : f.size] ** 2 + residual[:, f.size :] ** 2, axis=0)
    peaks = np.argsort(-power)[:_PEAKS]
    spacing = np.gradient(f)[peaks] if f.size > 1 else f[peaks]
    narrow = [(f[peaks], width * spacing / f[peaks]) for width in _WIDTHS]
    spread = np.geomspace(f[0] / BEYOND, f[-1] * BEYOND, _SPREAD)
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
