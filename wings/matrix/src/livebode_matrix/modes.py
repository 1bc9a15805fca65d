"""Modes and poles common to all entries of a matrix, with mode shapes, weighted by the covariance of the entries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import COVERAGE, FitError, MatrixResponses, Parameters, Responses
from livebode.dataclass import dataclass
from livebode.fitting import (
    CommonPoles,
    Hold,
    Kind,
    Outputs,
    SeparatedFit,
    assembled,
    check_model,
    outputs_of,
    pole_price,
    possible,
    reduced_structures,
    search,
    solve,
)
from livebode_matrix.least_squares import MatrixMinimum
from livebode_matrix.refinement import refined
from livebode_matrix.whitening import WeightedMatrix

ModeFit = tuple[SeparatedFit, MatrixMinimum]

_ROUNDS = 2
_HOPELESS = 200.0  # by how much more a structure costs with independent entries that is not fitted again


def chosen(
    weighted: WeightedMatrix, outs: Outputs, begun: Sequence[SeparatedFit], kind: Kind, *, fixed: bool
) -> list[ModeFit]:
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

    def fitted(start: SeparatedFit) -> ModeFit:
        modes, minimum = refined(weighted, outs, start)
        return replace(modes, cost=_cost(weighted, modes, minimum)), minimum

    fits = sorted((fitted(start) for start in begun), key=_by_cost)
    while fits:
        of = fits[0][0]
        limit = solve(outs, of.structure, of.theta, rounds=_ROUNDS).cost + _HOPELESS
        smaller = [
            solve(outs, structure, theta, rounds=_ROUNDS)
            for structure, theta in reduced_structures(of, kind, fixed=fixed)
            if outs.enough_for(structure)
        ]
        rivals = [fitted(candidate) for candidate in smaller if candidate.cost < limit]
        rivals = [rival for rival in rivals if possible(outs, rival[0], kind)]
        best = min(rivals, key=_by_cost, default=fits[0])
        if not best[0].cost < fits[0][0].cost:
            break
        fits[0] = best
    return fits


def _by_cost(fit: ModeFit) -> tuple[bool, float]:
    return not fit[0].settled, fit[0].cost


def _cost(weighted: WeightedMatrix, of: SeparatedFit, minimum: MatrixMinimum) -> float:
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


@dataclass(frozen=True, eq=False)
class MatrixModes(CommonPoles):
    """Poles common to all entries of a matrix; `outputs` are the entries, as "velocity2/u1". See `fit_matrix`.

    Attributes
    ----------
    size
        Numbers of outputs and inputs.
    """

    size: tuple[int, int]

    @property
    def residues(self) -> Complex:
        """R of the pole with the positive imaginary part of each mode, shape (modes, outputs, inputs)."""
        return _residues(self.parameters.names, self.parameters.value[0], self.outputs).reshape(-1, *self.size)

    @property
    def shapes(self) -> Parameters:
        """Mode shapes at the outputs as a fraction of the largest: size and phase, with bounds.

        The residue of a mode is its shape times how strongly each input drives it: a matrix of rank one. The shape is
        the first left singular vector of the residues. Names are "shape_1 velocity2" and "shape phase_1 velocity2".
        """
        names = tuple(dict.fromkeys(entry.rpartition("/")[0] for entry in self.outputs))
        modes = range(len(self.residues))
        shown = [f"{word}_{r + 1} {name}" for r in modes for word in ("shape", "shape phase") for name in names]
        units = [unit for _ in modes for unit in ("", "°") for _ in names]
        largest = np.argmax(np.abs(_shapes(self.residues)), axis=1)

        def of(values: Floats) -> Floats:
            whole = _residues(self.parameters.names, values, self.outputs)
            shape = _shapes(whole.reshape(*whole.shape[:-1], *self.size))
            shape = shape / np.take_along_axis(
                shape, np.broadcast_to(largest[:, np.newaxis], (*shape.shape[:-1], 1)), axis=-1
            )
            both = np.stack([np.abs(shape), np.degrees(np.angle(shape))], axis=-2)
            return both.reshape(*values.shape[:-1], len(shown))

        return self.parameters.derived(tuple(shown), tuple(units), of)

    def rows(self, probability: float = COVERAGE) -> list[tuple[str, float, float, str]]:
        """Name, value, half-width and unit of all quantities, mode shapes last."""
        own = super().rows(probability)
        if self.status != "ok" or not len(self.residues):
            return own
        of = self.shapes
        return own + list(zip(of.names, of.value[0].tolist(), of.bound(probability)[0].tolist(), of.units))

    @property
    def about_bounds(self) -> str:
        """What the bounds cover, as text."""
        return super().about_bounds + "; they contain the covariance of the entries"


def fit_matrix(
    responses: MatrixResponses,
    model: Kind = "rational",
    *,
    order: int | None = None,
    band_hz: tuple[float, float] | None = None,
    hold: Hold = "zero-order",
    like: MatrixModes | None = None,
) -> MatrixModes:
    """Fit poles that all entries of a matrix have in common, with bounds from the covariance of the entries.

    Number and kind of the poles are found as in `fit_common_poles`, with the entries as outputs. All parameters are
    then fitted again by least squares with the inverse of noise ⊗ spread + (ε|G|)² as weights at each line, one ε for
    all entries. Entries share noise: the scatter of a frequency is therefore larger or smaller than independent entries
    would have it. The noise is estimated with `dof` degrees of freedom; the bounds contain the scatter of such weights.

    A search with independent entries proposes structures. All are fitted again, and the one with the smallest cost by
    the likelihood of the whole matrix is taken, without the terms that do not lower it.

    Delay: none. Bias: none to first order where order and noise are right. The bounds do not contain the choice of the
    order. Errors of neighbouring lines are alike beside a slow mode. With six rows of a recording or more, the bounds
    contain this as the rows show it; with fewer, lines are taken as independent.

    Parameters
    ----------
    responses
        All matrices of a recording; the mean of those that share no window is fitted (`mean_matrix`). Lines are used
        where all columns are valid.
    model
        "rational" for complex and real poles, or "modal" for modes between the lines.
    order
        Number of poles without integrators, or of modes; by default the best one.
    band_hz
        Lowest and highest frequency of the lines used.
    hold
        Hold of the inputs.
    like
        An earlier fit of this machine: its structure and poles are the start, without a search.

    Raises
    ------
    UsageError, GridError, FitError
        As `fit_common_poles`; or if the noise has too few degrees of freedom for its covariance. A fit that fails is
        not an error: its status gives the reason.

    Examples
    --------
    >>> from livebode_matrix import example_matrix_responses
    >>> fit = fit_matrix(example_matrix_responses(), order=2)
    >>> fit.status, fit.order, fit.outputs
    ('ok', 2, ('velocity1/u1', 'velocity1/u2', 'velocity2/u1', 'velocity2/u2'))
    """
    check_model(model, order)
    weighted = WeightedMatrix.of(responses, band_hz)
    matrix = weighted.mean
    whole = matrix.valid[0].all(axis=1)
    entries = [_entry(matrix, o, i, whole) for o in range(len(matrix.outputs)) for i in range(len(matrix.inputs))]
    names = tuple(f"{o}/{i}" for o in matrix.outputs for i in matrix.inputs)
    outs = outputs_of(entries, names, band_hz, hold)
    kind = model if like is None else like.model
    if like is not None:
        best = [refined(weighted, outs, _started(like, names))]
    else:
        best = chosen(weighted, outs, search(outs, model, order), model, fixed=order is not None)
    specified = order is not None or like is not None
    covariance = best[0][1].covariance if best else None
    fitted = assembled(
        outs, [modes for modes, _ in best], names, entries, kind, specified=specified, covariance=covariance
    )
    given = {field.name: getattr(fitted, field.name) for field in fields(CommonPoles)}
    return MatrixModes(**given, size=(len(matrix.outputs), len(matrix.inputs)))


def _entry(matrix: MatrixResponses, output: int, input: int, whole: NDArray[np.bool_]) -> Responses:
    entry = matrix.entry(output, input)
    return replace(entry, valid=entry.valid & whole)


def _started(like: MatrixModes, names: tuple[str, ...]) -> SeparatedFit:
    if like.best is None or like.status != "ok" or like.outputs != names:
        raise FitError(
            "not-fitted",
            "the earlier fit is not valid, or is of other entries",
            "leave `like` out, so that the poles are searched for",
            status=like.status,
        )
    return like.best


def _residues(names: tuple[str, ...], values: Floats, entries: tuple[str, ...]) -> Complex:
    """From quantities (..., names), shape (..., modes, entries)."""
    modes = sum(name.startswith("frequency_") for name in names)
    places = [[names.index(f"{word}_{r + 1} {entry}") for r in range(modes) for entry in entries]
          for word in ("residue", "phase")]  # fmt: skip
    size, phase = (values[..., np.array(columns, dtype=np.intp)] for columns in places)
    residues: Complex = np.asarray(size * np.exp(1j * np.radians(phase)), dtype=np.complex128)
    return residues.reshape(*values.shape[:-1], modes, len(entries))


def _shapes(residues: Complex) -> Complex:
    """First left singular vectors, shape (..., modes, outputs)."""
    if not residues.size:
        return residues[..., 0]
    return np.asarray(np.linalg.svd(residues, full_matrices=False)[0][..., 0])
