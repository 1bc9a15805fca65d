"""The NumPy twin of one row's search: Levenberg–Marquardt from a start, or from a scan of resonances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from livebode.kernel import RIGID, TWO_MASS, FitModel
from tests.twins.elementary import exp, log
from tests.twins.fit_arithmetic import Curve, Floats, matrix_product, product, solve
from tests.twins.fit_model import LinePlaces, ModelTransfer, evaluate, respond, sampled_of
from tests.twins.fit_weighing import WeighedRow

_STEP, _TOLERANCE, _RISE, _FALL, _ENOUGH, _LARGEST = 1e-7, 1e-10, 10.0, 0.2, 1e-4, 0.7
_SCANNED, _TRIED, _QUALITY, _LEAST = 48, 4, 10.0, 1e-3
_NEAR_BOUND, _LEAST_DOF, _CONDITION_MAX, _ROUNDING = 1e-6, 3.0, 1e11, 1e-14
ROUNDS = 30
"""Steps of a search at most, where it does not begin at the parameters of a row before."""


@dataclass
class SearchPoint:
    """A point of the search: coordinates, values, cost, gradient, Gauss–Newton matrix, response and its slopes."""

    x: Floats
    values: Floats
    cost: Any = np.inf
    gradient: Floats = field(default_factory=lambda: np.zeros(0))
    matrix: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    response: Curve = (np.zeros(0), np.zeros(0))
    slope: Sequence[Curve] = ()
    is_settled: bool = False


class FitSearch:
    """One row's search."""

    def __init__(self, model: FitModel, places: LinePlaces, row: WeighedRow, last: int | None = None) -> None:
        self.model, self.places, self.row = model, places, row
        self.begin, self.low, self.high, self.scale, self.held = model.table
        self.at: list[int] = sorted(np.flatnonzero(np.isnan(self.held)).tolist(), key=lambda at: at == last)
        self.is_log = self.low > 0
        self.lowest, self.highest = (np.array([self.coordinate(at, e[at]) for at in self.at]) for e in model.table[1:3])

    def coordinate(self, at: int, value: Any) -> Any:
        return log(abs(value)) if self.is_log[at] else value / self.scale[at]

    def value_of(self, at: int, x: Any) -> Any:
        return exp(x) if self.is_log[at] else x * self.scale[at]

    def minimised(self, start: Floats, rounds: int) -> SearchPoint:
        """Levenberg–Marquardt; the response of a point that has converged is the one before the last step."""
        start = np.where(np.isnan(self.held), start, self.held)
        now = self._measured(np.array([self.coordinate(at, start[at]) for at in self.at]), start)
        damping = 1e-3
        for _ in range(rounds):
            x, step = self._step(now, damping)
            if self._is_last(now, step):
                now.x, now.values, now.is_settled = x, self._valued(x, now.values), bool(np.isfinite(now.cost))
                return now
            tried = self._measured(x, start)
            if tried.cost < now.cost:
                now, damping = tried, damping * _FALL
            else:
                damping = damping * _RISE
        return now

    def _valued(self, x: Floats, values: Floats) -> Floats:
        found = values.copy()
        for k, at in enumerate(self.at):
            found[at] = self.value_of(at, x[k])
        return found

    def _measured(self, x: Floats, start: Floats) -> SearchPoint:
        values = self._valued(x, start)
        response = respond(self.places, self.model, values)
        slopes = []
        for k, at in enumerate(self.at):
            moved = values.copy()
            moved[at] = self.value_of(at, x[k] + _STEP)
            there = respond(self.places, self.model, moved)
            slopes.append(((there[0] - response[0]) / _STEP, (there[1] - response[1]) / _STEP))
        row, n = self.row, len(self.at)
        rest = response[0] - row.value[0], response[1] - row.value[1]
        cost = product(row.weight, rest, rest)
        gradient = np.array([product(row.weight, a, rest) for a in slopes])
        matrix = np.array([[product(row.weight, a, b) for b in slopes] for a in slopes])
        if not (np.isfinite(cost) and np.isfinite(gradient).all() and np.isfinite(matrix).all()):
            cost, gradient, matrix = np.float64(np.inf), np.zeros(n), np.eye(n)
        return SearchPoint(x, values, cost, gradient, matrix, response, slopes)

    def _step(self, p: SearchPoint, damping: float) -> tuple[Floats, Floats]:
        """The point after a step within the bounds, and the step. A parameter that its bound blocks is left out."""
        kept = ((p.x <= self.lowest) & (p.gradient > 0)) | ((p.x >= self.highest) & (p.gradient < 0))
        gradient = np.where(kept, 0.0, p.gradient)
        matrix = np.where(kept[:, np.newaxis] | kept, np.eye(len(kept)), p.matrix)
        diagonal = np.diagonal(matrix)
        largest = max(np.max(np.where(np.isnan(diagonal), 0.0, diagonal)), 0.0)
        matrix = matrix + np.diag(damping * diagonal + (1e-12 * largest + 1e-300))
        step = -solve(matrix, gradient[:, np.newaxis])[:, 0]
        x = (p.x + step.clip(-_LARGEST, _LARGEST)).clip(self.lowest, self.highest)
        return x, x - p.x

    def _is_last(self, p: SearchPoint, step: Floats) -> bool:
        """Whether it is small, or promises too little."""
        promised = np.float64(0.0)
        for one, slope in zip(step, p.gradient):
            promised = promised - one * slope
        promised = promised / 2.0
        return bool((np.abs(step) < _TOLERANCE).all() or 0 <= promised < _ENOUGH)

    def scanned(self) -> SearchPoint:
        """The best of the fits from a scan of resonances."""
        best: SearchPoint | None = None
        for share, omega in self._starts():
            found = self.minimised(self._start_at(share, omega), ROUNDS)
            if best is None or _judged_cost(found) < _judged_cost(best):
                best = found
        assert best is not None  # there is one start at least
        return best

    def _starts(self) -> list[tuple[tuple[Any, Any, Any], Any]]:
        """Weights of rigid body and mode and their cost at the best resonances, and those."""
        m, p = self.model, self.places
        rigid = evaluate(p, sampled_of(ModelTransfer(1.0, 0.0, 0.0, 1.0, 0.0, 0.0, m.integrators), p.tick, 0.0))
        if m.kind == RIGID:
            (weight,), cost = self._weights([rigid])
            return [((weight, 0.0, cost), np.float64(0.0))]
        low, high = 2.0 * np.pi * (p.lowest_hz / 2.0), 2.0 * np.pi * (p.highest_hz * 2.0)
        step = log(high / low) / (_SCANNED - 1.0)
        omegas = [low * exp(step * k) for k in range(_SCANNED)]
        shares = [self._share_at(rigid, omega) for omega in omegas]
        cost = np.array([one[2] for one in shares])
        minima = [
            k
            for k in range(_SCANNED)
            if (k == 0 or cost[k] <= cost[k - 1]) and (k + 1 == _SCANNED or cost[k] <= cost[k + 1])
        ]
        return [(shares[k], omegas[k]) for k in sorted(minima, key=lambda k: cost[k])[:_TRIED] or [0]]

    def _share_at(self, rigid: Curve, omega: Any) -> tuple[Any, Any, Any]:
        m = self.model
        n0, n1 = (1.0, 0.0) if m.integrators == 2 else (0.0, 1.0)  # s/(s² + ωs/Q + ω²), over s for a position
        mode = ModelTransfer(n0, n1, 0.0, omega * omega, omega / _QUALITY, 1.0, 0)
        shape = evaluate(self.places, sampled_of(mode, self.places.tick, 0.0))
        ratio = -1.0 if m.at_load else m.ratio if m.kind == TWO_MASS else 0.0
        if ratio == 0:
            (one, two), cost = self._weights([rigid, shape])
            return one, two, cost
        both = rigid[0] + ratio * shape[0], rigid[1] + ratio * shape[1]
        (one,), cost = self._weights([both])
        if m.at_load:
            return one, one * (m.ratio if m.ratio > 0 else 1.0), cost
        return one, abs(ratio) * one, cost

    def _weights(self, basis: list[Curve]) -> tuple[list[Any], Any]:
        """Linear least squares, made positive, and its cost."""
        row, lever = self.row, self.model.lever if self.model.at_load else 1.0
        along = np.array([product(row.weight, b, row.value) / lever for b in basis])
        matrix = np.array([[product(row.weight, a, b) for b in basis] for a in basis])
        matrix = matrix + np.diag(1e-9 * np.diagonal(matrix))
        solved = solve(matrix, along[:, np.newaxis])[:, 0]
        largest = max(np.max(np.where(np.isnan(solved), 0.0, np.abs(solved))), 0.0)
        floor = _LEAST * largest + 1e-300
        weights, cost = [x if x > floor else floor for x in solved], np.float64(0.0)
        for k, one in enumerate(weights):
            for i, other in enumerate(weights):
                cost = cost + one * matrix[k, i] * other
            cost = cost - 2.0 * one * along[k]
        return weights, cost

    def _start_at(self, share: tuple[Any, Any, Any], omega: Any) -> Floats:
        m, (rigid, mode, _) = self.model, share
        whole, found = rigid + mode, np.zeros(len(self.held))
        if m.kind == RIGID:
            found[0] = (m.lever if m.at_load else 1.0) / rigid
        elif m.kind == TWO_MASS:
            motor, load = 1.0 / whole, mode / (rigid * whole)
            spring = motor * load * rigid * (omega * omega)
            values = [motor, load / m.arm, spring / m.arm, spring / (omega * _QUALITY) / m.arm]
            if m.ratio > 0:
                del values[1]
            found[: len(values)] = values
        else:
            high = omega / (2.0 * np.pi)
            found[:5] = rigid, high * np.sqrt(rigid / whole), high, 0.5 / _QUALITY, 0.5 / _QUALITY
        return np.where(np.isfinite(found), found, self.begin).clip(self.low, self.high)

    def is_at_bound(self, values: Floats) -> bool:
        x = np.array([self.coordinate(at, values[at]) for at in self.at])
        return bool(((x - self.lowest < _NEAR_BOUND) | (self.highest - x < _NEAR_BOUND)).any())

    def covariance(self, p: SearchPoint, noise_dof: Any) -> Floats:
        """Of the coordinates. Where a weight has few degrees of freedom, weighted least squares scatter more."""
        row, n = self.row, len(self.at)
        d = np.float64(np.inf) if np.isnan(noise_dof) else max(noise_dof, np.float64(_LEAST_DOF))
        factor = 2.0 / (d - 2.0) * (1.0 - n / (2.0 * row.count))
        share = row.noise * row.weight / 2.0
        more = row.weight * (1.0 + share * share * factor)
        matrix, scattered = (
            np.array([[product(w, a, b) for b in p.slope] for a in p.slope]) for w in (row.weight, more)
        )
        scale = np.sqrt(np.diagonal(matrix))
        outer = scale[:, np.newaxis] * scale
        scaled, unit = matrix / outer, np.eye(n)
        finite = np.isfinite(scaled).all()
        inverse = solve((scaled if finite else unit) + _ROUNDING * unit, unit)
        determined = finite and (np.abs(inverse) < _CONDITION_MAX).all()
        inverse = inverse / outer if determined else np.full((n, n), np.nan)
        return matrix_product(matrix_product(inverse, scattered), inverse)


def _judged_cost(p: SearchPoint) -> Any:
    return p.cost if p.is_settled else p.cost + 1e300
