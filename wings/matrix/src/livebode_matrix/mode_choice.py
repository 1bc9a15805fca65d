"""Which of several structures the entries of a matrix show, by the likelihood with their common noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from livebode.fitting import Kind, Outputs, SeparatedFit, pole_price, possible, reduced_structures, solve
from livebode_matrix.least_squares import MatrixMinimum
from livebode_matrix.refinement import refined
from livebode_matrix.whitening import Weighted

Fitted = tuple[SeparatedFit, MatrixMinimum]

_ROUNDS = 2
_HOPELESS = 200.0  # by how much more a structure costs with independent entries that is not fitted again


def chosen(
    weighted: Weighted, outs: Outputs, begun: Sequence[SeparatedFit], kind: Kind, *, fixed: bool
) -> list[Fitted]:
    """Fits by increasing cost, the first without the terms that do not lower it.

    A search with independent entries takes noise that they share for a pole: outputs whose noise is alike, and the
    columns of an output, which contain the same noise, show it again and again. Here all are fitted and compared by the
    likelihood of the whole matrix.

    Parameters
    ----------
    begun
        Fits with independent entries.
    fixed
        Whether the number of poles remains.
    """

    def fitted(one: SeparatedFit) -> Fitted:
        found, minimum = refined(weighted, outs, one)
        return replace(found, cost=_cost(weighted, found, minimum)), minimum

    found = sorted((fitted(one) for one in begun), key=_by_cost)
    while found:
        of = found[0][0]
        limit = solve(outs, of.structure, of.theta, rounds=_ROUNDS).cost + _HOPELESS
        smaller = [
            solve(outs, structure, theta, rounds=_ROUNDS)
            for structure, theta in reduced_structures(of, kind, fixed=fixed)
            if outs.enough_for(structure)
        ]
        rivals = [fitted(one) for one in smaller if one.cost < limit]
        rivals = [one for one in rivals if possible(outs, one[0], kind)]
        best = min(rivals, key=_by_cost, default=found[0])
        if not best[0].cost < found[0][0].cost:
            break
        found[0] = best
    return found


def _by_cost(one: Fitted) -> tuple[bool, float]:
    return not one[0].settled, one[0].cost


def _cost(weighted: Weighted, of: SeparatedFit, minimum: MatrixMinimum) -> float:
    """−2·ln(likelihood) and the price of the parameters, as that of `SeparatedFit`.

    Noise whose covariance is estimated makes the errors of a line a complex matrix of Student's distribution: (d + m)·
    ln det(I + N⁻¹·E·S⁻¹·E*/d) + m·ln det N, for m inputs (Gupta and Nagar, Matrix Variate Distributions, 2000, ch. 4).
    The model error adds to N its mean over the inputs in units of S, and d grows as the share of noise falls.
    """
    lines, entries = weighted.value.shape
    inputs = weighted.spread.shape[1]
    shape = (lines, weighted.outputs, inputs)
    error = minimum.error.reshape(shape)
    own = np.einsum("kii->ki", weighted.spread).real[:, np.newaxis]
    size = np.mean(np.abs(weighted.value.reshape(shape)) ** 2 / own, axis=2)
    total = weighted.noise + minimum.epsilon**2 * size[:, :, np.newaxis] * np.eye(weighted.outputs)
    share = np.einsum("koo->k", np.linalg.solve(total, weighted.noise)).real.mean() / weighted.outputs
    dof = weighted.dof / share**2
    square = error @ np.linalg.solve(weighted.spread.conj(), np.swapaxes(error, 1, 2).conj())
    unit = np.eye(weighted.outputs) + np.linalg.solve(total, square) / dof
    likely = 2 * (dof + inputs) * np.linalg.slogdet(unit)[1] + 2 * inputs * np.linalg.slogdet(total)[1]
    structure = of.structure
    price = pole_price(lines, 2 * lines * entries * (1 - share))
    return float(likely.sum() + structure.size * np.log(2 * lines * entries) + structure.poles * price)
