"""Gauss–Newton on the output's error: the step of a Machine's model from its residuals of healthy runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from livebode.arrays import Floats
from livebode.monitoring.evidence import Evidence
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.motion import PositionCurve, basis

_SMOOTH = 1e-4  # of the mean curvature of the cost: only what no run passed follows its neighbours
_SLOPE_MAX = 0.5  # of a logarithm per half range of a covariate: prior standard deviation


def joint_step(
    parts: Sequence[Evidence], machine: LearnedMachine, own: Floats, rate_hz: float
) -> tuple[Floats, Floats]:
    """Step of the unknowns and the delay, and the new offsets of the runs, which are eliminated (Schur complement)."""
    assert machine.between is not None
    direction, prior = machine.between.direction, machine.between.spread**-2
    gradient, matrix = normal(parts, machine, rate_hz)
    shared = np.zeros((len(parts), gradient.size))
    score, information = np.zeros((2, len(parts)))
    information += prior
    for i, seen in ((i, part) for i, part in enumerate(parts) if len(part)):
        along, late = seen.information @ direction, seen.late_information[:, :-1] @ direction
        shared[i] = np.append(np.einsum("rju,rj->u", _design(seen, machine), along), late.sum() / rate_hz)
        score[i] = (seen.score @ direction).sum() - prior * own[i]
        information[i] += (along @ direction).sum()
    gain = shared / information[:, np.newaxis]
    step = step_of((gradient - gain.T @ score, matrix - gain.T @ shared), machine)
    return step, own + (score - shared @ step) / information


def _design(seen: Evidence, machine: LearnedMachine) -> Floats:
    """From the unknowns to the logarithms of stiffness, load, damping, inertia, (rows, 4, unknowns).

    The unknowns are the model's, and the slope of each logarithm per half range of each covariate.
    """
    model, own = machine.model, len(DIRECTIONS)
    k, b, c = len(model.log_stiffness.weights), len(model.log_damping.weights), len(machine.covariates)
    design = np.zeros((len(seen), own, 2 + k + b + own * c))
    design[:, 1, 0] = design[:, 3, 1] = 1.0
    design[:, 0, 2 : 2 + k] = basis(seen.position_m, model.low_m, model.high_m, k)
    design[:, 2, 2 + k : 2 + k + b] = basis(seen.position_m, model.low_m, model.high_m, b)
    value = (seen.covariate - machine.covariates.mean) / machine.covariates.half_range
    for j in range(own):
        first = 2 + k + b + j * c
        design[:, j, first : first + c] = value
    return design


def normal(parts: Sequence[Evidence], machine: LearnedMachine, rate_hz: float) -> tuple[Floats, Floats]:
    """Gradient and information of the unknowns and of the delay in samples, without a prior."""
    gradients, matrices = zip(*(normal_of(part, machine, rate_hz) for part in parts if len(part)))
    return np.sum(gradients, axis=0), np.sum(matrices, axis=0)


def normal_of(seen: Evidence, machine: LearnedMachine, rate_hz: float) -> tuple[Floats, Floats]:
    """Normal equations of one run's windows, (unknowns + 1,), (unknowns + 1, unknowns + 1)."""
    design = _design(seen, machine)
    gradient = np.append(np.einsum("rju,rj->u", design, seen.score), seen.late_score.sum() / rate_hz)
    matrix = np.zeros((gradient.size, gradient.size))
    matrix[:-1, :-1] = np.einsum("rju,rjk,rkv->uv", design, seen.information, design, optimize=True)
    matrix[-1, :-1] = np.einsum("rju,rj->u", design, seen.late_information[:, :-1]) / rate_hz
    matrix[:-1, -1] = matrix[-1, :-1]
    matrix[-1, -1] = seen.late_information[:, -1].sum() / rate_hz**2
    return gradient, matrix


def step_of(normal: tuple[Floats, Floats], machine: LearnedMachine) -> Floats:
    """Step of the unknowns, and of the delay in samples."""
    gradient, matrix = normal
    model, slopes = machine.model, machine.covariates.slope * machine.covariates.half_range
    k, b = len(model.log_stiffness.weights), len(model.log_damping.weights)
    unknowns = np.concatenate(
        [np.zeros(2), model.log_stiffness.weights, model.log_damping.weights, slopes.ravel(), np.zeros(1)]
    )
    pull = np.zeros_like(matrix)
    for part in (slice(2, 2 + k), slice(2 + k, 2 + k + b)):
        differences = np.diff(np.eye(unknowns[part].size), n=3, axis=0)
        pull[part, part] = _SMOOTH * np.trace(matrix[part, part]) / unknowns[part].size * differences.T @ differences
    part = slice(2 + k + b, -1)
    pull[part, part] = np.eye(slopes.size) / _SLOPE_MAX**2
    step = np.linalg.solve(matrix + pull, gradient - pull @ unknowns)
    step[:-1] = step[:-1].clip(-0.2, 0.2)
    step[-1] = step[-1].clip(-1.0, 1.0)
    return np.asarray(step)


def moved(machine: LearnedMachine, step: Floats, rate_hz: float) -> LearnedMachine:
    """The Machine after a step of its model, its delay and its covariates' slopes."""
    model, covariates = machine.model, machine.covariates
    k, b = len(model.log_stiffness.weights), len(model.log_damping.weights)
    low, high = model.low_m, model.high_m
    moved = replace(
        model,
        load_kg=float(model.load_kg * np.exp(step[0])),
        inertia_kg_m2=float(model.inertia_kg_m2 * np.exp(step[1])),
        log_stiffness=PositionCurve(low, high, model.log_stiffness.weights + step[2 : 2 + k]),
        log_damping=PositionCurve(low, high, model.log_damping.weights + step[2 + k : 2 + k + b]),
    )
    slopes = step[2 + k + b : -1].reshape(covariates.slope.shape) / covariates.half_range
    return replace(
        machine,
        model=moved,
        delay_s=machine.delay_s + float(step[-1]) / rate_hz,
        covariates=replace(covariates, slope=covariates.slope + slopes),
    )
