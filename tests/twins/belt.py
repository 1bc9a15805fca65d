"""Two masses joined by a belt, behind a zero-order hold, in NumPy: the definition of `native/src/belt`, with its bits.

(14) is α/s + β·s/(s² + 2δ·s + Ω) with α = 1/(J + m), β = 1/J − α, δ = b/2μ, Ω = k/μ, μ = J·m·α. Behind a zero-order
hold, with w = z − 1 and e = E − 1 of the poles E = e^(pT), it is α·T/w + β·g·w/((w − e1)(w − e2)) with
g = (e1 − e2)/(p1 − p2): nothing cancels where lines and poles are near 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from livebode.kernel import BeltCourse, BeltGrid, BeltMasses, BeltNormal, BeltRows, BeltSplines
from tests.twins import elementary

Floats = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Pair = tuple[Floats, Floats]
"""Real and imaginary part."""

_LANES = 8
_ORDER = 8
_exp, _expm1 = (np.vectorize(f, otypes=[np.float64]) for f in (elementary.exp, elementary.expm1))


class _Mode(NamedTuple):
    """α, β, g, e1 + e2, e1·e2, and slopes: of α and β by both inertias, of the rest by δ and Ω, of these by the four
    parameters. Each a column over the rows."""

    alpha: Floats
    beta: Floats
    g: Floats
    sum: Floats
    product: Floats
    alpha_by: Pair
    beta_by: Pair
    g_by: Pair
    sum_by: Pair
    product_by: Pair
    delta_by: list[Floats]
    omega_by: list[Floats]


def response(grid: BeltGrid, parameters: Floats) -> Complex:
    """As `belt_response`."""
    with np.errstate(all="ignore"):
        re, im = _respond(_mode(parameters, 1.0 / grid.rate_hz), _Places(grid))[2]
    return np.asarray(re + 1j * im)


def each(grid: BeltGrid, rows: BeltRows, parameters: Floats) -> BeltNormal:
    """As `belt_each`."""
    with np.errstate(all="ignore"):
        g, slopes = _slopes(_mode(parameters, 1.0 / grid.rate_hz), _Places(grid))
        rest = g[0] - rows.value.real, g[1] - rows.value.imag
        terms = _terms([*slopes[:4], rest], rows.weight * rows.weight)
    return BeltNormal(terms[4, 4], terms[4, :4].T.copy(), terms[:4, :4].transpose(2, 0, 1).copy())


def together(grid: BeltGrid, rows: BeltRows, splines: BeltSplines, unknowns: Floats) -> BeltNormal:
    """As `belt_together`."""
    one = np.ones((len(rows.value), 1))
    parts = [one, one, splines.stiffness, splines.damping, one]
    ends = np.cumsum([part.shape[1] for part in parts])
    at = [slice(end - part.shape[1], end) for end, part in zip(ends.tolist(), parts)]
    parameters = np.zeros((len(rows.value), 4))
    for i in range(4):
        for share, unknown in zip(parts[i].T, unknowns[at[i]]):
            parameters[:, i] += share * unknown
    cosine, sine = elementary.turned(grid.theta * unknowns[-1])
    re, im = rows.value.real, rows.value.imag
    turned = re * cosine - im * sine, re * sine + im * cosine
    found = BeltNormal(np.zeros(1), np.zeros((1, unknowns.size)), np.zeros((1, unknowns.size, unknowns.size)))
    with np.errstate(all="ignore"):
        g, slopes = _slopes(_mode(parameters, 1.0 / grid.rate_hz), _Places(grid))
        terms = _terms([*slopes, (g[0] - turned[0], g[1] - turned[1])], rows.weight * rows.weight)
        for row in range(len(rows.value)):
            shares = [part[row] for part in parts]
            for i, share in enumerate(shares):
                some = np.flatnonzero(share)  # so that a term that is not finite does not meet a zero
                here = at[i].start + some
                found.gradient[0, here] += share[some] * terms[5, i, row]
                for j in range(i + 1):
                    found.matrix[0, here, at[j]] += np.outer(share[some] * terms[i, j, row], shares[j])
            found.cost[0] += terms[5, 5, row]
    low = np.tril(found.matrix[0])
    found.matrix[0] = low + np.tril(low, -1).T
    return found


def replay(masses: BeltMasses, course: BeltCourse) -> tuple[Floats, Floats]:
    """As `belt_replay`.

    The momentum J·ω + r·m·v is the sum of the torque alone. What is left is an oscillator of the belt's elongation and
    its rate ω·r − v, whose transition over a tick (a Taylor series of order 8) does not depend on the state.
    """
    inertia, load, radius = masses
    arm, tick = radius * load, 1.0 / course.rate_hz
    share = radius * radius / inertia + 1.0 / load
    whole, push = 1.0 / (inertia + radius * arm), radius / inertia
    stiffness, damping = share * course.stiffness_n_per_m, share * course.damping_n_s_per_m
    torque = course.torque_n_m
    rates, momenta = np.empty(torque.size), np.empty(torque.size)
    e = rate = momentum = np.float64(0.0)
    with np.errstate(all="ignore"):
        of_e, of_rate, pushed = _transition(tick, stiffness, damping)
        for n in range(torque.size):
            rates[n], momenta[n] = rate, momentum
            pull = push * torque[n] - stiffness[n] * e
            e, rate = e + (of_e[n] * rate + pushed[n] * pull), of_rate[n] * rate + of_e[n] * pull
            momentum = momentum + tick * torque[n]
        motor = (momenta + arm * rates) * whole
        return motor, radius * motor - rates


def _transition(tick: float, stiffness: Floats, damping: Floats) -> tuple[Floats, Floats, Floats]:
    """After a tick: elongation and rate from a rate of 1, and elongation from an acceleration of 1."""
    e, rate = np.zeros_like(stiffness), np.ones_like(stiffness)
    of_e, of_rate, of_push = e, rate, e
    for order in range(1, _ORDER + 1):
        share = tick / order
        pushed = share * e
        e = share * rate
        rate = -(stiffness * pushed + damping * e)
        of_e, of_rate, of_push = of_e + e, of_rate + rate, of_push + pushed
    return of_e, of_rate, of_push


class _Places:
    """w, w², T/w and θ at each line, shape (lines,)."""

    def __init__(self, grid: BeltGrid) -> None:
        tick, re, im = 1.0 / grid.rate_hz, grid.step.real, grid.step.imag
        size = re * re + im * im
        self.w = re, im
        self.square = re * re - im * im, 2.0 * re * im
        self.rigid = tick * re / size, -(tick * im / size)
        self.theta = grid.theta


def _mode(parameters: Floats, tick: float) -> _Mode:
    motor, load, stiffness, damping = _exp(parameters.T)[..., np.newaxis] if parameters.size else np.zeros((4, 0, 1))
    alpha = 1.0 / (motor + load)
    of_load, of_motor = load * alpha, motor * alpha
    reduced = motor * of_load
    delta, omega = damping / (2.0 * reduced), stiffness / reduced
    square = delta * delta - omega
    g, total, product = _poles(delta, square, tick)
    bend = (tick * (0.5 * (total + 2.0)) - g) / (2.0 * square)
    total_by = tick * (2.0 * delta * g - (total + 2.0)), -(tick * g)
    none = np.zeros_like(delta)
    return _Mode(
        alpha,
        of_load / motor,
        g,
        total,
        product,
        (-(alpha * of_motor), -(alpha * of_load)),
        (alpha * of_motor - 1.0 / motor, alpha * of_load),
        (2.0 * delta * bend - tick * g, -bend),
        total_by,
        (-2.0 * tick * _decay(delta, tick) - total_by[0], tick * g),
        [-(delta * of_load), -(delta * of_motor), none, delta],
        [-(omega * of_load), -(omega * of_motor), omega, none],
    )


def _decay(delta: Floats, tick: float) -> Floats:
    return np.asarray(_exp(-2.0 * delta * tick)) if delta.size else delta


def _poles(delta: Floats, square: Floats, tick: float) -> tuple[Floats, Floats, Floats]:
    """g, e1 + e2 and e1·e2."""
    if not delta.size:
        return delta, delta, delta
    root = np.sqrt(np.abs(square))
    (_, half), (cosine, sine) = elementary.turned(0.5 * (root * tick)), elementary.turned(root * tick)
    re = _expm1(-delta * tick) * cosine - 2.0 * half * half
    im = _exp(-delta * tick) * sine
    one, two = _expm1((root - delta) * tick), _expm1((-root - delta) * tick)
    swings = square < 0.0
    return (
        np.where(swings, im / root, (one - two) / (2.0 * root)),
        np.where(swings, 2.0 * re, one + two),
        np.where(swings, re * re + im * im, one * two),
    )


def _respond(m: _Mode, at: _Places) -> tuple[Pair, Pair, Pair]:
    """h = 1/(w² − sum·w + product), q = w·h, and the response."""
    re, im = at.square[0] - m.sum * at.w[0] + m.product, at.square[1] - m.sum * at.w[1]
    size = re * re + im * im
    h = re / size, -(im / size)
    q = at.w[0] * h[0] - at.w[1] * h[1], at.w[0] * h[1] + at.w[1] * h[0]
    re, im = (m.alpha * rigid + m.beta * (m.g * part) for rigid, part in zip(at.rigid, q))
    return h, q, (re, im)


def _slopes(m: _Mode, at: _Places) -> tuple[Pair, list[Pair]]:
    """The response, and its slopes by the four parameters and by a delay."""
    h, q, g = _respond(m, at)
    by = []
    for g_by, sum_by, product_by in zip(m.g_by, m.sum_by, m.product_by):
        re, im = (sum_by * a - product_by * b for a, b in zip(q, h))
        g_re, g_im = m.g * q[0], m.g * q[1]
        by.append((g_by * q[0] + (g_re * re - g_im * im), g_by * q[1] + (g_re * im + g_im * re)))
    none = np.zeros_like(m.alpha)
    slopes = []
    for i in range(4):
        delta_by, omega_by = m.beta * m.delta_by[i], m.beta * m.omega_by[i]
        alpha_by, beta_by = (m.alpha_by[i], m.beta_by[i] * m.g) if i < 2 else (none, none)
        re, im = (
            (alpha_by * at.rigid[k] + beta_by * q[k]) + (delta_by * by[0][k] + omega_by * by[1][k]) for k in (0, 1)
        )
        slopes.append((re, im))
    slopes.append((at.theta * g[1], -(at.theta * g[0])))
    return g, slopes


def _terms(curves: list[Pair], square: Floats) -> Floats:
    """Σ square·Re(conj(a)·b) over the lines, eight at a time, of each curve with each, (curves, curves, rows)."""
    rows, lines = square.shape
    found = np.empty((len(curves), len(curves), rows))
    wide = np.zeros((rows, -(-lines // _LANES) * _LANES))
    for i, a in enumerate(curves):
        for j, b in enumerate(curves[: i + 1]):
            products = a[0] * b[0] + a[1] * b[1]
            wide[:, :lines], wide[:, lines:] = square * products, 0.0 * products[:, :1]
            s = np.zeros((rows, _LANES))
            for tile in np.split(wide, wide.shape[1] // _LANES, axis=1):
                s = s + tile
            left, right = (s[:, k] + s[:, k + 4] + (s[:, k + 2] + s[:, k + 6]) for k in (0, 1))
            found[i, j] = found[j, i] = left + right
    return found
