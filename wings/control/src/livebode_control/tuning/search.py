"""The search: the controller with the highest bandwidth, or the most robust one with a required bandwidth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Model
from livebode.dataclass import dataclass
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.problem import TuningProblem
from livebode_control.tuning.specification import LoopSpecification
from livebode_control.tuning.structure import FeedbackStructure, TunedFeedback

_WEIGHTS = {"gain": 1.0, "integral_time": -0.15, "position_gain": 0.15, "derivative_time": 0.02, "low_pass": 0.01}
_PER_NOTCH = {"depth": 0.01, "damping": -0.005}
_ROUNDS, _STEPS, _MOVE = 5, 12, 0.7
_ACTIVE = 60  # points with the least clearance, which alone limit a step
_STARTS = 20  # crossovers of the textbook settings
_CORNERS = np.array([0.4, 0.8, 1.6])  # of a low-pass, over the highest line: where the search begins
_BACK = 25  # halvings of the way back to a controller that keeps every limit
_SIMPLER = 0.05  # of the gain, that a filter must bring
_PROMINENCE_DB = 4.0


@dataclass(frozen=True, eq=False)
class SearchResult:
    """A controller that keeps every limit, and how good it is: the larger, the better."""

    problem: TuningProblem
    x: Floats
    merit: float


def search(
    controller: Model | None, plant: PlantBand, specification: LoopSpecification, fixed: TunedFeedback | None = None
) -> SearchResult | None:
    """The best controller of the described structure, with few filters; None if none keeps the limits.

    The filters of `fixed` are in series, too.

    Sequential quadratic programming (SLSQP) over the logarithms of the parameters, with the nearest points of the
    Nyquist plot as constraints, from the fastest feasible of a row of textbook settings. The result is a local
    optimum; its limits are verified at all points.
    """
    best: SearchResult | None = None
    for notches, low_pass in _filters(plant, specification):
        structure = FeedbackStructure(controller, plant.frequency_hz, notches, low_pass=low_pass, fixed=fixed)
        problem = TuningProblem(structure, plant, specification)
        result = _optimised(problem, best)
        if result is not None and (best is None or result.merit > best.merit + _SIMPLER):
            best = result
    return best


def resonances(plant: PlantBand, count: int) -> list[float]:
    """Frequencies of the highest resonances over all places, the highest first; Hz."""
    from scipy.signal import find_peaks

    peaks_of_rows: list[tuple[float, float]] = []
    shown = ~plant.above & (plant.frequency_hz >= plant.lines_hz[0])
    f = plant.frequency_hz[shown]
    for row in plant.value[:, shown]:
        level = 20 * np.log10(np.abs(row) * f)
        peaks, facts = find_peaks(level, prominence=_PROMINENCE_DB)
        peaks_of_rows += zip(facts["prominences"].tolist(), f[peaks].tolist())
    chosen: list[float] = []
    for _, frequency in sorted(peaks_of_rows, reverse=True):
        if all(abs(np.log(frequency / other)) > np.log(1.3) for other in chosen):
            chosen.append(frequency)
    return chosen[:count]


def _filters(plant: PlantBand, specification: LoopSpecification) -> Iterator[tuple[Sequence[float], bool]]:
    """Sets of filters, from none to all that are permitted."""
    yield (), False
    peaks = resonances(plant, specification.notches)
    if peaks:
        yield peaks, False
    if specification.low_pass:
        yield peaks, True


def _optimised(problem: TuningProblem, simpler: SearchResult | None) -> SearchResult | None:
    """The best local optimum: from textbook settings, with a low-pass of several corners, or else from the simpler."""
    corners_hz = [None, *(problem.plant.lines_hz[-1] * _CORNERS)] if problem.structure.low_pass else [None]
    starts = [_start(problem, corner_hz) for corner_hz in corners_hz]
    if starts[0] is None and simpler is not None:
        starts.append(_extended(problem, simpler))
    results = [improved(problem, start) for start in starts if start is not None]
    return max(results, key=lambda result: result.merit, default=None)


def improved(problem: TuningProblem, x: Floats) -> SearchResult:
    """The local optimum from a controller that keeps every limit."""
    required = problem.specification.bandwidth_hz is not None
    for _ in range(_ROUNDS):
        moved = _moved(problem, x, required)
        new = _feasible_part(problem, x, moved)
        if new is None:
            break
        gained = merit(problem, new) - merit(problem, x)
        x = new
        if gained < 1e-3:
            break
    return SearchResult(problem, x, merit(problem, x))


def merit(problem: TuningProblem, x: Floats) -> float:
    """What is maximised: the weighted logarithms of the gains, or with a required bandwidth the least clearance."""
    if problem.specification.bandwidth_hz is None:
        return float(_direction(problem.structure) @ x)
    short = float(np.min(problem.tracking(x)[0]))
    return float(np.min(problem.clearances(x))) + 0.01 * float(_direction(problem.structure) @ x) + min(short, 0) * 10


def _direction(structure: FeedbackStructure) -> Floats:
    def weight(name: str) -> float:
        return _PER_NOTCH.get(name.partition("_")[2], 0.0) if name.startswith("notch") else _WEIGHTS[name]

    return np.array([weight(name) for name in structure.names])


def _start(problem: TuningProblem, corner_hz: float | None) -> Floats | None:
    """The fastest of textbook settings with crossovers over the lines that keeps the limits."""
    lines = problem.plant.lines_hz
    for crossover_hz in np.geomspace(lines[-1] / 2, lines[0], _STARTS):
        x = _textbook(problem, float(crossover_hz), corner_hz)
        if problem.feasible(x):
            return x
    return None


def _textbook(problem: TuningProblem, crossover_hz: float, corner_hz: float | None) -> Floats:
    """Settings with this crossover; the corner of a low-pass is eight times that if none is given."""
    structure = problem.structure
    omega = 2 * np.pi * crossover_hz
    values = {
        "integral_time": 5 / omega,
        "derivative_time": 0.5 / omega,
        "position_gain": 0.15 * omega,
        "low_pass": corner_hz or max(8 * crossover_hz, 0.02 * structure.rate_hz),
    }
    x = np.array([np.log(values[n]) if n in values else s for n, s in zip(structure.names, structure.start)])
    x = np.clip(x, structure.low, structure.high)
    f, _ = structure.response(x)
    near = int(np.argmin(np.abs(problem.plant.frequency_hz - crossover_hz)))
    x[0] -= np.log(np.max(np.abs(problem.plant.value[:, near] * f[near])))
    return np.asarray(x)


def _extended(problem: TuningProblem, simpler: SearchResult) -> Floats | None:
    """The result without the additional filters, these as mild as possible; None if that breaks a limit."""
    names, known = problem.structure.names, dict(zip(simpler.problem.structure.names, simpler.x))
    mild = {"low_pass": problem.structure.high[-1]}
    x = np.array(
        [known.get(n, 0.0 if n.endswith("_depth") else mild.get(n, s)) for n, s in zip(names, problem.structure.start)]
    )
    x[0] -= 0.1
    return x if problem.feasible(x) else None


def _moved(problem: TuningProblem, x: Floats, required: bool) -> Floats:
    """One run of SLSQP within a box around x; with a required bandwidth, the last variable is the least clearance."""
    from scipy.optimize import minimize

    structure = problem.structure
    nearest = _nearest(problem, x)
    columns = np.any(nearest, axis=0)
    near, selected = problem.only(columns), nearest[:, columns]
    direction = _direction(structure)
    size = len(x)
    low, high = np.maximum(structure.low, x - _MOVE), np.minimum(structure.high, x + _MOVE)
    scale = 0.01 if required else 1.0
    goal = np.append(-scale * direction, -1.0) if required else -direction

    @lru_cache(maxsize=1)  # SLSQP asks for values and slopes at the same point, one after the other
    def clearances(x: bytes) -> tuple[Floats, Floats]:
        value, slope = near.sloped_clearances(np.frombuffer(x))
        return value[selected], slope[selected]

    def limits(z: Floats) -> Floats:
        parts = [clearances(z[:size].tobytes())[0] - (z[-1] if required else 1e-4)]
        if required:
            parts.append(problem.tracking(z[:size])[0])
        if (limit := problem.specification.noise_limit) is not None:
            parts.append(np.array([np.log(limit / problem.noise_gain(z[:size])[0])]))
        return np.concatenate(parts)

    def slopes(z: Floats) -> Floats:
        gradients = clearances(z[:size].tobytes())[1]
        rows = [np.column_stack([gradients, np.full(len(gradients), -1.0)]) if required else gradients]
        if required:
            part = problem.tracking(z[:size])[1]
            rows.append(np.column_stack([part, np.zeros(len(part))]))
        if problem.specification.noise_limit is not None:
            gradient = -problem.noise_gain(z[:size])[1]
            rows.append(np.append(gradient, np.zeros(len(z) - size))[np.newaxis])
        return np.concatenate(rows)

    begin = np.append(x, float(np.min(problem.clearances(x)))) if required else x
    bounds = list(zip(np.append(low, [-2.0] * required), np.append(high, [2.0] * required)))
    solution = minimize(  # type: ignore[call-overload]
        lambda z: float(goal @ z), begin, jac=lambda _: goal, bounds=bounds, method="SLSQP",
        constraints={"type": "ineq", "fun": limits, "jac": slopes}, options={"maxiter": _STEPS, "ftol": 1e-5},
    )  # fmt: skip
    z = np.asarray(solution.x[:size], dtype=np.float64)
    return np.clip(np.where(np.isfinite(z), z, x), low, high)


def _nearest(problem: TuningProblem, x: Floats) -> NDArray[np.bool_]:
    """The points with the least clearance, which a step can reach."""
    value = problem.clearances(x)
    count = min(_ACTIVE, value.size)
    chosen = np.zeros(value.shape, dtype=bool)
    chosen.flat[np.argpartition(value.ravel(), count - 1)[:count]] = True
    # Each place's local minima, so that no approach goes unseen.
    inner = (value[:, 1:-1] <= value[:, :-2]) & (value[:, 1:-1] <= value[:, 2:]) & (value[:, 1:-1] < 0.6)
    chosen[:, 1:-1] |= inner
    return chosen


def _feasible_part(problem: TuningProblem, x: Floats, moved: Floats) -> Floats | None:
    """`moved` with as little less gain as makes it keep every limit; else the part of the way that does."""
    base = merit(problem, x)
    for down in (0.0, 0.003, 0.01, 0.03, 0.1):
        less = moved.copy()
        less[0] -= down
        if problem.feasible(less) and merit(problem, less) > base:
            return less
    for part in (0.5, 0.25, 0.1, 0.03):
        way = x + part * (moved - x)
        if problem.feasible(way) and merit(problem, way) > base:
            return way
    return None
