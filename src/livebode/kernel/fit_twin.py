"""The NumPy twin of the fit: the readable definition of what `livebode.kernel.fit` computes in C, row by row.

The same operations in the same order, so C must agree with it to the bit (except for the sign and payload of NaN). All
arithmetic is real, and exp, log, sin and cos are those of `elementary_twin`, because those of a library, its complex
products and its sums differ between computers. A sum over lines has eight partial sums.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from livebode.kernel._fit import (
    AT_BOUND,
    FITTED,
    FRICTION,
    NO_MODEL,
    NO_RESPONSE,
    NOT_CONVERGED,
    NOT_SEEN,
    RIGID,
    TWO_MASS,
    TWO_MASS_GAIN,
    FitFound,
    FitModel,
    FitRows,
)
from livebode.kernel.elementary_twin import exp, expm1, expm1_of, log, turned

Floats = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Curve = tuple[Floats, Floats]
"""Real and imaginary parts, (lines,)."""

_LANES = 8
_APART = 1e-5
_STEP, _TOLERANCE, _RISE, _FALL, _ENOUGH, _LARGEST = 1e-7, 1e-10, 10.0, 0.2, 1e-4, 0.7
_SCANNED, _TRIED, _QUALITY, _LEAST = 48, 4, 10.0, 1e-3
_EPSILON_STEPS, _CLOSE = 30, 1e-6
_FIRST_EPSILON, _SAME, _EPSILON_MAX, _LACKING = 0.1, 0.01, 0.5, 0.03
_UNCERTAIN, _SUSPICIOUS, _NEAR_BOUND = 0.5, 4.0, 1e-6
_WARM_ROUNDS, _ROUNDS, _REWEIGHTED, _FRICTION_ROUNDS, _EXPLAINED = 12, 30, 8, 15, 0.5
_LEAST_DOF, _CONDITION_MAX, _ROUNDING = 3.0, 1e11, 1e-14


class SingularError(ArithmeticError):
    """A matrix has no inverse, so that the row has no fit."""


def fit(model: FitModel, frequency_hz: Floats, rate_hz: float, rows: FitRows) -> FitFound:
    """As `livebode.kernel.fit`."""
    count, lines = rows.value.shape
    found = FitFound.empty(count, lines, model.table.shape[1])
    with np.errstate(all="ignore"):
        places = LinePlaces(frequency_hz, rate_hz)
        for i in range(count):
            row = _Row(rows.value[i], rows.sigma[i], rows.use[i])
            start = None if rows.start is None else rows.start[i]
            epsilon = None if rows.epsilon is None else rows.epsilon[i]
            out = [part[i : i + 1] for part in found]
            _fit_row(_Problem(model, places, row), rows.noise_dof[i], start, epsilon, out)
    return found


def fit_response(model: FitModel, rate_hz: float, values: Floats, frequency_hz: Floats) -> Complex:
    """As `livebode.kernel.fit_response`."""
    with np.errstate(all="ignore"):
        every = np.broadcast_to(frequency_hz, (len(values), frequency_hz.shape[-1]))
        curves = [respond(LinePlaces(f, rate_hz), model, v) for f, v in zip(every, values)]
    found = np.empty(every.shape, np.complex128)
    for row, curve in zip(found, curves):
        row.real, row.imag = curve
    return found


def fit_epsilon(rest: Floats, noise: Floats, size: Floats, dof: Floats) -> Floats:
    """As `livebode.kernel.fit_epsilon`."""
    with np.errstate(all="ignore"):
        return np.array([_epsilon(*parts) for parts in zip(rest, noise, size, dof)])


def total(x: Floats) -> np.float64:
    """Sum with eight partial sums."""
    lanes = np.zeros(_LANES)
    for part in np.pad(x, (0, -len(x) % _LANES)).reshape(-1, _LANES):
        lanes = lanes + part
    s = lanes
    return np.float64(((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7])))


def product(square: Floats, a: Curve, b: Curve) -> np.float64:
    """Σ square·Re(a·conj(b))."""
    return total(square * (a[0] * b[0] + a[1] * b[1]))


class LinePlaces:
    """Tables of the lines: z = e^(jθ), w = z − 1."""

    def __init__(self, frequency_hz: Floats, rate_hz: float) -> None:
        self.tick = 1.0 / rate_hz
        self.lowest_hz, self.highest_hz = np.float64(frequency_hz.min()), np.float64(frequency_hz.max())
        self.theta = 2.0 * np.pi * frequency_hz * self.tick
        (cosine, sine), (_, half) = turned(self.theta), turned(0.5 * self.theta)
        self.w = -2.0 * half * half, sine
        self.before = cosine, -sine
        self.square = times(self.w, self.w)
        size = self.w[0] * self.w[0] + self.w[1] * self.w[1]
        self.once = self.w[0] / size, -self.w[1] / size
        self.once_late = times(self.once, self.before)
        self.twice = times(self.once, self.once)
        self.twice_late = times(self.twice, self.before)


def times(a: Any, b: Any) -> Any:
    """Product of complex numbers as pairs."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


class ModelTransfer(NamedTuple):
    """Numerator and denominator in s by powers, over s^integrators, and over s − slow if that is not None."""

    n0: Any
    n1: Any
    n2: Any
    d0: Any
    d1: Any
    d2: Any
    integrators: int
    slow: Any = None


def transfer_of(m: FitModel, v: Floats) -> ModelTransfer:
    """Of a model at its parameters."""
    if m.kind == RIGID:
        if v[1] != 0:
            return ModelTransfer(m.lever / v[0], 0.0, 0.0, 1.0, 0.0, 0.0, m.integrators - 1, -v[1] / v[0])
        return ModelTransfer(m.lever / v[0], 0.0, 0.0, 1.0, 0.0, 0.0, m.integrators)
    if m.kind == TWO_MASS:
        motor, load = v[0], v[0] * m.ratio if m.ratio > 0 else v[1] * m.arm
        spring, damper = (x * m.arm for x in v[1 if m.ratio > 0 else 2 :][:2])
        drag, load_drag = v[-3], v[-2] * m.arm
        both, drags = motor + load, drag + load_drag
        n0, n1, n2 = (m.lever * spring, m.lever * damper, 0.0) if m.at_load else (spring, damper + load_drag, load)
        if drags != 0:
            d3, d2 = motor * load, motor * (damper + load_drag) + load * (damper + drag)
            d1, d0 = both * spring + drag * load_drag + damper * drags, spring * drags
            slow = _slow_root(d3, d2, d1, d0)
            return ModelTransfer(n0, n1, n2, -d0 / slow, d2 + d3 * slow, d3, m.integrators - 1, slow)
        return ModelTransfer(n0, n1, n2, both * spring, both * damper, motor * load, m.integrators)
    low, high = 2.0 * np.pi * v[1], 2.0 * np.pi * v[2]
    n1, n2 = 2.0 * v[0] * v[3] / low, v[0] / (low * low)
    return ModelTransfer(v[0], n1, n2, 1.0, 2.0 * v[4] / high, 1.0 / (high * high), m.integrators)


def _slow_root(d3: Any, d2: Any, d1: Any, d0: Any) -> Any:
    """The real root nearest to zero of a passive machine's d3·s³ + d2·s² + d1·s + d0: between −d2/d3 and 0.

    Newton's steps, and a bisection where one leaves the interval.
    """
    low, high, x = -d2 / d3, np.float64(0.0), -d0 / d1
    for _ in range(60):
        value, slope = ((d3 * x + d2) * x + d1) * x + d0, (3.0 * d3 * x + 2.0 * d2) * x + d1
        low, high = (x, high) if value < 0 else (low, x)
        newton = x - value / slope
        following = newton if low < newton < high else 0.5 * (low + high)
        if abs(following - x) <= 1e-15 * abs(x):
            return following
        x = following
    return x


@dataclass
class SampledPoles:
    """Behind the hold: once·a + once_late·b + twice·c + twice_late·d, and a section of second order in w."""

    ticks: Any
    is_late: bool
    is_double: bool
    rest: tuple[Any, Any, Any, Any] = (0.0, 0.0, 0.0, 0.0)
    section: tuple[Any, ...] | None = None
    """n1, n0, late1, late0, d1, d0."""
    slow: tuple[Any, Any, Any] | None = None
    """Of first order: (slow + late/z)/(w − end)."""


def sampled_of(t: ModelTransfer, tick: float, delay_s: Any) -> SampledPoles:
    """Exactly behind a zero-order hold and a delay, pole by pole."""
    ticks = np.float64(delay_s) / tick
    s = SampledPoles(np.floor(ticks), bool(ticks != 0), t.integrators == 2)
    late = ticks - s.ticks
    soon = (1.0 - late) * tick if s.is_late else np.float64(tick)
    rest = tick - soon
    if t.integrators:
        constant = np.float64(t.n0) / (t.d0 if t.slow is None else t.d0 * -t.slow)
        speed = (t.n1 - constant * t.d1) / t.d0 if s.is_double else constant
        place = constant if s.is_double else 0.0
        s.rest = (
            speed * soon + place * (soon * soon / 2.0),
            speed * rest + place * ((tick * tick - soon * soon) / 2.0),
            place * tick * soon,
            place * tick * rest,
        )
    if t.d2 != 0:
        s.section = _section(t, tick, late, is_late=s.is_late)
    if t.slow is not None:
        p = t.slow
        below = (t.d2 * p + t.d1) * p + t.d0
        for _ in range(t.integrators + 1):
            below = below * p
        q, end = ((t.n2 * p + t.n1) * p + t.n0) / below, expm1(p * tick)
        soon = expm1(p * tick * (1.0 - late)) if s.is_late else end
        s.slow = q * soon, q * (end - soon), end
    return s


def _section(t: ModelTransfer, tick: float, late: Any, *, is_late: bool) -> tuple[Any, ...]:
    half, product_ = np.float64(-t.d1) / t.d2 / 2.0, np.float64(t.d0) / t.d2
    under = half * half - product_
    turn = np.sqrt(np.abs(under))
    if 2.0 * turn < _APART * np.sqrt(np.abs(product_)):
        return _real_pair(t, half * (1.0 - _APART), half * (1.0 + _APART), tick, late, is_late=is_late)
    if under < 0:
        return _complex_pair(t, half, turn, tick, late, is_late=is_late)
    # The larger one first: the difference of half and turn would lose the smaller one's digits.
    large = half + turn if half > 0 else half - turn
    return _real_pair(t, product_ / large, large, tick, late, is_late=is_late)


def _share(t: ModelTransfer, p: Any, other: Any) -> Any:
    """Residue over the pole, N(p)/(d2·(p − other)·p^integrators)/p."""
    value = times((t.n2 * p[0] + t.n1, t.n2 * p[1]), p)
    value = value[0] + t.n0, value[1]
    below = t.d2 * (p[0] - other[0]), t.d2 * (p[1] - other[1])
    if t.slow is not None:
        below = times(below, (p[0] - t.slow, p[1]))
    for _ in range(t.integrators + 1):
        below = times(below, p)
    size = below[0] * below[0] + below[1] * below[1]
    return (
        (value[0] * below[0] + value[1] * below[1]) / size,
        (value[1] * below[0] - value[0] * below[1]) / size,
    )


def _complex_pair(t: ModelTransfer, re: Any, im: Any, tick: float, late: Any, *, is_late: bool) -> tuple[Any, ...]:
    q, end = _share(t, (re, im), (re, -im)), expm1_of(re * tick, im * tick)
    soon = expm1_of(re * tick * (1.0 - late), im * tick * (1.0 - late)) if is_late else end
    first, second = times(q, soon), times(q, (end[0] - soon[0], end[1] - soon[1]))
    return (
        2.0 * first[0],
        -2.0 * (first[0] * end[0] + first[1] * end[1]),
        2.0 * second[0],
        -2.0 * (second[0] * end[0] + second[1] * end[1]),
        -2.0 * end[0],
        end[0] * end[0] + end[1] * end[1],
    )


def _real_pair(t: ModelTransfer, one: Any, two: Any, tick: float, late: Any, *, is_late: bool) -> tuple[Any, ...]:
    end, first, second = [], [], []
    for p, other in ((one, two), (two, one)):
        q = _share(t, (p, 0.0), (other, 0.0))[0]
        end.append(expm1(p * tick))
        soon = expm1(p * tick * (1.0 - late)) if is_late else end[-1]
        first.append(q * soon)
        second.append(q * (end[-1] - soon))
    return (
        first[0] + first[1],
        -(first[0] * end[1] + first[1] * end[0]),
        second[0] + second[1],
        -(second[0] * end[1] + second[1] * end[0]),
        -(end[0] + end[1]),
        end[0] * end[1],
    )


def evaluate(p: LinePlaces, s: SampledPoles) -> Curve:
    """Response at the lines."""
    a, b, c, d = s.rest
    re, im = a * p.once[0], a * p.once[1]
    if s.is_double:
        re, im = re + c * p.twice[0], im + c * p.twice[1]
    if s.is_late:
        re = re + (b * p.once_late[0] + d * p.twice_late[0])
        im = im + (b * p.once_late[1] + d * p.twice_late[1])
    if s.section is not None:
        n1, n0, late1, late0, d1, d0 = s.section
        below = p.square[0] + d1 * p.w[0] + d0, p.square[1] + d1 * p.w[1]
        above = n1 * p.w[0] + n0, n1 * p.w[1]
        if s.is_late:
            late = times((late1 * p.w[0] + late0, late1 * p.w[1]), p.before)
            above = above[0] + late[0], above[1] + late[1]
        size = below[0] * below[0] + below[1] * below[1]
        re = re + (above[0] * below[0] + above[1] * below[1]) / size
        im = im + (above[1] * below[0] - above[0] * below[1]) / size
    if s.slow is not None:
        slow, slow_late, end = s.slow
        below = p.w[0] - end, p.w[1]
        above = (slow + slow_late * p.before[0], slow_late * p.before[1]) if s.is_late else (slow, 0.0)
        size = below[0] * below[0] + below[1] * below[1]
        re = re + (above[0] * below[0] + above[1] * below[1]) / size
        im = im + (above[1] * below[0] - above[0] * below[1]) / size
    if s.ticks != 0:
        re, im = times((re, im), turned(-(p.theta * s.ticks)))
    return re, im


def respond(p: LinePlaces, m: FitModel, values: Floats) -> Curve:
    """Response of a model at the lines."""
    return evaluate(p, sampled_of(transfer_of(m, values), p.tick, values[-1]))


class _Row:
    """A row as it is fitted: measured parts, squared noise (0: not known), squared weights and sizes."""

    def __init__(self, value: Complex, sigma: Floats, use: npt.NDArray[np.bool_]) -> None:
        self.use, self.count = use, int(np.count_nonzero(use))
        self.value: Curve = np.where(use, value.real, 0.0), np.where(use, value.imag, 0.0)
        self.noise = np.where(use & (sigma > 0), sigma * sigma, 0.0)
        self.size = self.value[0] * self.value[0] + self.value[1] * self.value[1]
        self.rest = np.zeros(len(use))
        self.weight = self.rest

    def weigh(self, epsilon: Any) -> None:
        """For the present sizes; by size alone where neither noise nor ε is known."""
        self.weight = self._weights(epsilon * epsilon)
        if not (self.weight > 0).any():
            self.weight = self._weights(1.0)

    def _weights(self, square: Any) -> Floats:
        variance = self.noise + square * self.size
        return np.where(self.use & (variance > 0), 2.0 / variance, 0.0)

    def take_residuals(self, response: Curve) -> None:
        re, im = self.value[0] - response[0], self.value[1] - response[1]
        self.rest = np.where(self.use, re * re + im * im, 0.0)
        self.size = np.where(self.use, response[0] * response[0] + response[1] * response[1], 0.0)

    def epsilon(self, dof: Any) -> np.float64:
        return _epsilon(self.rest, self.noise, self.size, dof)

    def reduced(self, square: Any) -> np.float64:
        return _reduced(self.rest, self.noise, self.size, square)


def _reduced(rest: Floats, noise: Floats, size: Floats, square: Any) -> np.float64:
    return total(np.where(rest > 0, 2.0 * rest / (noise + square * size), 0.0))


def _epsilon(rest: Floats, noise: Floats, size: Floats, dof: Any) -> np.float64:
    """ε ≥ 0 with Σ 2·rest/(noise + ε²·size) = dof."""
    if not dof > 0 or _reduced(rest, noise, size, 0.0) <= dof:
        return np.float64(0.0)
    # No line has more than all together, which bounds ε² from below; from there the left side is convex and falls, so
    # that Newton's steps climb to the root and never pass it.
    least = (2.0 * rest / dof - noise) / size
    square = np.max(np.where((rest > 0) & np.isfinite(least), least, 0.0), initial=0.0)
    for _ in range(_EPSILON_STEPS):
        share = np.where(rest > 0, 1.0 / (noise + square * size), 0.0)
        every, falls = 2.0 * total(rest * share), 2.0 * total(rest * share * (size * share))
        step = (every - dof) / falls if falls > 0 else np.float64(0.0)
        square = square + np.maximum(step, 0.0)
        if not step > _CLOSE * square:
            break
    return np.sqrt(square) if np.isfinite(square) else np.float64(0.0)


def solve(matrix: Floats, right: Floats) -> Floats:
    """matrix·x = right (n, columns) by Gauss with partial pivoting; SingularError without a solution."""
    matrix, right, n = matrix.copy(), right.copy(), len(matrix)
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            pivot = i if abs(matrix[i, k]) > abs(matrix[pivot, k]) else pivot
        if matrix[pivot, k] == 0:
            raise SingularError
        matrix[[k, pivot]], right[[k, pivot]] = matrix[[pivot, k]], right[[pivot, k]]
        for i in range(k + 1, n):
            share = matrix[i, k] / matrix[k, k]
            matrix[i, k + 1 :] = matrix[i, k + 1 :] - share * matrix[k, k + 1 :]
            right[i] = right[i] - share * right[k]
    for k in reversed(range(n)):
        for i in range(k + 1, n):
            right[k] = right[k] - matrix[k, i] * right[i]
        right[k] = right[k] / matrix[k, k]
    return right


@dataclass
class _Point:
    """A point of the search: coordinates, values, cost, gradient, Gauss–Newton matrix, response and its slopes."""

    x: Floats
    values: Floats
    cost: Any = np.inf
    gradient: Floats = field(default_factory=lambda: np.zeros(0))
    matrix: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    response: Curve = (np.zeros(0), np.zeros(0))
    slope: Sequence[Curve] = ()
    is_settled: bool = False


class _Problem:
    """One row's search."""

    def __init__(self, model: FitModel, places: LinePlaces, row: _Row, last: int | None = None) -> None:
        self.model, self.places, self.row = model, places, row
        self.begin, self.low, self.high, self.scale, self.held = model.table
        self.at: list[int] = sorted(np.flatnonzero(np.isnan(self.held)).tolist(), key=lambda at: at == last)
        self.is_log = self.low > 0
        self.lowest, self.highest = (np.array([self.coordinate(at, e[at]) for at in self.at]) for e in model.table[1:3])

    def coordinate(self, at: int, value: Any) -> Any:
        return log(abs(value)) if self.is_log[at] else value / self.scale[at]

    def value_of(self, at: int, x: Any) -> Any:
        return exp(x) if self.is_log[at] else x * self.scale[at]

    def minimised(self, start: Floats, rounds: int) -> _Point:
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

    def _measured(self, x: Floats, start: Floats) -> _Point:
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
        return _Point(x, values, cost, gradient, matrix, response, slopes)

    def _step(self, p: _Point, damping: float) -> tuple[Floats, Floats]:
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

    def _is_last(self, p: _Point, step: Floats) -> bool:
        """Whether it is small, or promises too little."""
        promised = np.float64(0.0)
        for one, slope in zip(step, p.gradient):
            promised = promised - one * slope
        promised = promised / 2.0
        return bool((np.abs(step) < _TOLERANCE).all() or 0 <= promised < _ENOUGH)

    def scanned(self) -> _Point:
        """The best of the fits from a scan of resonances."""
        best: _Point | None = None
        for share, omega in self._starts():
            found = self.minimised(self._start_at(share, omega), _ROUNDS)
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

    def covariance(self, p: _Point, noise_dof: Any) -> Floats:
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
        return _multiplied(_multiplied(inverse, scattered), inverse)


def _judged_cost(p: _Point) -> Any:
    return p.cost if p.is_settled else p.cost + 1e300


def _multiplied(a: Floats, b: Floats) -> Floats:
    found = np.zeros(a.shape)
    for i in range(len(a)):
        found = found + a[:, i, np.newaxis] * b[i]
    return found


def _fit_row(problem: _Problem, noise_dof: Any, start: Floats | None, epsilon: Any, out: list[Any]) -> None:
    row = problem.row
    dof = 2.0 * row.count - len(problem.at)
    try:
        if not dof > 0:
            _write_none(out, dof, NO_RESPONSE)
            return
        row.weigh(_FIRST_EPSILON if epsilon is None else epsilon)
        found = _begun(problem, start, dof)
        if epsilon is None:
            found, epsilon = _reweighted(problem, found, dof)
        else:
            row.take_residuals(found.response)
            # A row with a much larger model error than the previous ones is less certain than they were.
            epsilon = row.epsilon(dof) if row.epsilon(_SUSPICIOUS * dof) > epsilon else epsilon
        _write(problem, found, noise_dof, dof, epsilon, out)
    except SingularError:
        _write_none(out, dof, NOT_CONVERGED)


def _begun(problem: _Problem, start: Floats | None, dof: float) -> _Point:
    """From the start, and where this fails the best fit of a scan."""
    if start is None:
        return problem.scanned()
    found = problem.minimised(start, _WARM_ROUNDS)
    if found.is_settled and not found.cost > _SUSPICIOUS * dof:
        return found
    again = problem.scanned()
    return again if again.cost < found.cost or not found.is_settled else found


def _reweighted(problem: _Problem, found: _Point, dof: float) -> tuple[_Point, Any]:
    """Fits repeated with the ε of their residuals until it stays."""
    epsilon: Any = _FIRST_EPSILON
    for _ in range(_REWEIGHTED):
        problem.row.take_residuals(found.response)
        now = problem.row.epsilon(dof)
        if abs(now - epsilon) <= _SAME * now:
            break
        epsilon = now
        problem.row.weigh(now)
        found = problem.minimised(found.values, _ROUNDS)
    return found, epsilon


def _write_none(out: list[Any], dof: float, status: int) -> None:
    for part in (0, 1, 3, 4, 6, 7):
        out[part][0] = np.nan + 1j * np.nan if part == 6 else np.nan
    out[2][0], out[5][0] = status, dof


def _write(problem: _Problem, found: _Point, noise_dof: Any, dof: float, epsilon: Any, out: list[Any]) -> None:
    row, at = problem.row, problem.at
    row.take_residuals(found.response)
    row.weigh(epsilon)
    small = problem.covariance(found, noise_dof)
    unseen = not np.isfinite(small).all() or not (np.sqrt(np.diagonal(small)) <= _UNCERTAIN)[problem.is_log[at]].all()
    status = FITTED
    for word, failed in (
        (NO_MODEL, row.reduced(_EPSILON_MAX * _EPSILON_MAX) > dof),
        (NOT_SEEN, unseen),
        (AT_BOUND, problem.is_at_bound(found.values)),
        (NOT_CONVERGED, not found.is_settled),
    ):
        status = word if failed else status
    out[0][0] = found.values if status == FITTED else np.nan
    out[1][0] = 0.0 if status == FITTED else np.nan
    if status == FITTED:
        outward = np.where(problem.is_log, found.values, problem.scale)[at]
        out[1][0][np.ix_(at, at)] = outward[:, np.newaxis] * small * outward
    known = row.noise > 0
    out[2][0], out[3][0] = status, epsilon if status == FITTED else np.nan
    out[4][0] = total(np.where(known, 2.0 * row.rest / row.noise, 0.0)) if known.any() else np.nan
    out[5][0] = dof
    out[6][0].real, out[6][0].imag = found.response
    out[7][0] = found.values
    if status == FITTED and row.reduced(_LACKING * _LACKING) > dof and _explained(problem, found, dof):
        out[2][0] = FRICTION
        for part in (0, 1, 3):
            out[part][0] = np.nan


def _explained(problem: _Problem, found: _Point, dof: float) -> bool:
    """Whether ε falls to less than half as soon as one viscous friction is fitted too."""
    m, n, row = problem.model, len(problem.held), problem.row
    if m.kind == TWO_MASS_GAIN:
        return False
    epsilon = row.epsilon(dof)
    for at in (1,) if m.kind == RIGID else (n - 3, n - 2):
        arm = m.arm if m.kind == TWO_MASS and at == n - 2 else 1.0
        # A friction that stops the motor in as long as ten of the lowest line's radians take.
        shown = found.values[0] * (2.0 * np.pi * problem.places.lowest_hz / 10.0) / arm
        table, start = m.table.copy(), found.values.copy()
        table[3, at], table[4, at], start[at] = shown, np.nan, shown
        row.take_residuals((np.zeros(len(row.use)), np.zeros(len(row.use))))
        row.size = row.rest
        row.weigh(epsilon / 2.0)
        # The friction is the last of the free parameters.
        wider = _Problem(m._replace(table=table), problem.places, row, last=at)
        try:
            with_friction = wider.minimised(start, _FRICTION_ROUNDS)
        except SingularError:
            continue
        row.take_residuals(with_friction.response)
        if row.epsilon(dof - 1.0) < _EXPLAINED * epsilon:
            return True
    return False
