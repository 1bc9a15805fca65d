"""Start values for masses in a chain: a scan of resonances, and from modes to masses and springs."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.fitting.physical import EvaluationGrid
from livebode.fitting.transfer import Transfer

QUALITY = 10.0
"""Quality factor of the scanned resonances; Table I of Nevaranta 2016 has it."""

_SCANNED = {0: 1, 1: 48, 2: 20}  # frequencies by number of modes; for two modes all pairs are tried, 190 of 20
_TRIED = {0: 1, 1: 4, 2: 16}  # by number of modes: with more of them there are more local minima
_LEAST = 1e-3  # of the largest weight, for one that is negative


def scan(
    value: Complex, weight: Floats, grid: EvaluationGrid, *, modes: int, integrators: int, ratio: float | None = None
) -> tuple[Floats, Floats]:
    """Weights of the rigid body and of each mode, (starts, rows, 1 + modes), and the modes' ω, (starts, rows, modes).

    G = α/s + Σ β·s/(s² + ωs/Q + ω²) (over s for a position) is linear in α and β: for every resonance of a grid from
    half the lowest to twice the highest line they are solved for, and the best few are selected. With a known `ratio`,
    β = ratio·α.
    """
    f = grid.frequency_hz
    omegas = 2 * np.pi * np.geomspace(f.min() / 2, f.max() * 2, _SCANNED[modes])
    rigid = _part([1.0], [1.0] + [0.0] * integrators, grid)
    integrator_zeros = [0.0] * (integrators - 1)
    shapes = [_part([1.0, 0.0], [1.0, w / QUALITY, w * w, *integrator_zeros], grid) for w in omegas]
    sets = np.array(list(combinations(range(len(omegas)), modes)), dtype=int)
    basis = np.array([[rigid, *(shapes[i] for i in chosen)] for chosen in sets])
    if ratio is not None:
        basis = basis[:, :1] + ratio * basis[:, 1:]
    solved, cost = _solved(basis, value, weight)
    if ratio is not None:
        solved = np.concatenate([solved, np.abs(ratio) * solved], axis=-1)
    if modes == 1:
        beside = np.pad(cost, ((1, 1), (0, 0)), constant_values=np.inf)
        cost = np.where((cost <= beside[:-2]) & (cost <= beside[2:]), cost, np.inf)
    best = np.argsort(cost, axis=0, kind="stable")[: _TRIED[modes]]
    return solved[best, np.arange(len(value))], omegas[sets][best]


def chain_of(weights: Floats, omega: Floats) -> tuple[Floats, Floats, Floats]:
    """Inertias, stiffnesses and dampings of masses in a row that have these modes at the first mass.

    Lanczos' recursion on the modes' squares with the weights as the first vector's squares gives the tridiagonal matrix
    M^(−1/2)·K·M^(−1/2), and its null vector the square roots of the masses. Weights (..., n), ω (..., n − 1).
    """
    squares = np.concatenate([np.zeros_like(omega[..., :1]), omega**2], axis=-1)
    total = weights.sum(axis=-1, keepdims=True)
    now, before, link = np.sqrt(weights / total), np.zeros_like(weights), np.zeros_like(total)
    inertia, springs, first = [1 / total[..., 0]], [], now[..., 0]
    for _ in range(omega.shape[-1]):
        moved = squares * now - np.sum(squares * now**2, axis=-1, keepdims=True) * now - link * before
        link = np.linalg.norm(moved, axis=-1, keepdims=True)
        before, now = now, moved / link
        inertia.append(inertia[0] * (now[..., 0] / first) ** 2)
        springs.append(link[..., 0] * np.sqrt(inertia[-1] * inertia[-2]))
    spring = np.stack(springs, axis=-1)
    return np.stack(inertia, axis=-1), spring, spring / (omega[..., :1] * QUALITY)


def _part(numerator: list[float], denominator: list[float], grid: EvaluationGrid) -> Complex:
    transfer = Transfer.of(numerator, denominator)
    s = np.asarray(2j * np.pi * grid.frequency_hz, dtype=np.complex128)
    if grid.hold == "none":
        return transfer.response(s)
    return transfer.sampled(np.exp(s / grid.rate_hz), grid.rate_hz)


def _solved(basis: Complex, value: Complex, weight: Floats) -> tuple[Floats, Floats]:
    """Weights (sets, rows, parts), made positive, and their cost (sets, rows)."""
    square = weight**2
    product = (basis[:, :, np.newaxis] * basis[:, np.newaxis].conj()).real
    matrix = np.einsum("skml,rl->srkm", product, square)
    right = np.einsum("skl,rl->srk", basis.real, square * value.real)
    right = right + np.einsum("skl,rl->srk", basis.imag, square * value.imag)
    size = np.einsum("srkk->srk", matrix)
    matrix = matrix + 1e-9 * size[..., np.newaxis] * np.eye(size.shape[-1])
    solved = np.linalg.solve(matrix, right[..., np.newaxis])[..., 0]
    solved = np.maximum(solved, _LEAST * np.abs(solved).max(axis=-1, keepdims=True) + 1e-300)
    power = np.sum(square * np.abs(value) ** 2, axis=-1)
    fitted = np.einsum("srk,srkm,srm->sr", solved, matrix, solved) - 2 * np.sum(solved * right, axis=-1)
    return solved, power + fitted
