"""The NumPy twin of a model's response: drive models, exactly behind a zero-order hold and a delay, at the lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from livebode.kernel import RIGID, TWO_MASS, FitModel
from tests.twins.elementary import expm1, expm1_of, turned
from tests.twins.fit_arithmetic import Curve, Floats, times

_APART = 1e-5


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
