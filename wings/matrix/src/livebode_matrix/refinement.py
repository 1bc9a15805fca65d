"""Partial fractions of all entries, fitted with the covariance of the entries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.fitting import Outputs, PartialFractions, SeparatedFit, Structure
from livebode_matrix.least_squares import MatrixMinimum, minimise
from livebode_matrix.whitening import WeightedMatrix

_TICK_STEP = 1e-4  # of a tick, for the slope by a delay


def refined(weighted: WeightedMatrix, outs: Outputs, of: SeparatedFit) -> tuple[SeparatedFit, MatrixMinimum]:
    """A structure, from its parameters on, fitted with the covariance of the entries; its cost is unchanged."""
    structure = of.structure
    shapes = PartialFractions(structure, outs.grid._replace(frequency_hz=weighted.frequency_hz), outs.unit)
    minimum = minimise(
        weighted,
        lambda raw: _response(shapes, structure, raw),
        lambda raw: _slopes(shapes, structure, raw),
        np.concatenate([of.theta, of.linear.ravel()]),
    )
    return _separated(of, outs, minimum), minimum


def _parts(of: Structure, raw: Floats) -> tuple[Floats, Floats]:
    """Nonlinear parameters, and weights (entries, linear)."""
    return raw[: of.nonlinear], raw[of.nonlinear :].reshape(of.outputs, of.linear)


def _response(shapes: PartialFractions, of: Structure, raw: Floats) -> Complex:
    """Response of all entries, shape (lines, entries)."""
    theta, linear = _parts(of, raw)
    if not of.delays:
        return np.asarray(shapes.columns(theta, 0.0) @ linear.T)
    return np.stack([shapes.columns(theta, float(t)) @ c for t, c in zip(of.delays_of(theta), linear)], axis=1)


def _slopes(shapes: PartialFractions, of: Structure, raw: Floats) -> Complex:
    """By all parameters, shape (lines, entries, parameters)."""
    theta, linear = _parts(of, raw)
    slope = np.zeros((shapes.grid.frequency_hz.size, of.outputs, raw.size), dtype=np.complex128)
    step = _TICK_STEP / shapes.grid.rate_hz
    columns, moves = shapes.columns(theta, 0.0), shapes.moves(theta, 0.0)
    for k, delay_s in enumerate(of.delays_of(theta).tolist()):
        if of.delays:
            columns, moves = shapes.columns(theta, delay_s), shapes.moves(theta, delay_s)
            later, earlier = (shapes.columns(theta, delay_s + way * step) @ linear[k] for way in (1, -1))
            slope[:, k, of.poles + k] = (later - earlier) / (2 * step)
        slope[:, k, : of.poles] = shapes.slopes(moves, linear[k])
        begin = of.nonlinear + k * of.linear
        slope[:, k, begin : begin + of.linear] = columns
    return slope


def _separated(of: SeparatedFit, outs: Outputs, minimum: MatrixMinimum) -> SeparatedFit:
    structure = of.structure
    theta, linear = _parts(structure, minimum.values)
    response = _response(PartialFractions(structure, outs.grid, outs.unit), structure, minimum.values).T
    measured = outs.measured
    variance = measured.sigma**2 + (minimum.epsilon * np.abs(measured.value)) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = np.where(measured.use & (variance > 0), np.sqrt(2 / variance), 0.0)
    epsilon = np.full(structure.outputs, minimum.epsilon)
    return replace(
        of, theta=theta, linear=linear, response=response, weight=weight, epsilon=epsilon, settled=minimum.settled
    )
