"""Many belt axes at once, whose parameters change while they run: other equations than those of `livebode.simulation`.

Runge and Kutta's method with one step a tick, all axes in one array. A cascade of position and velocity moves each cart
forward and back; the velocity that is recorded has noise, the position an encoder's steps. The motor has a friction of
its own, and the spans of the belt have different dampings.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block
from tools.motion_equations import JS, L3, ML, C, R

Floats = NDArray[np.float64]

RATE_HZ = 4000.0
CHANNELS = ("w", "u", "velocity", "x")
LOW_M, HIGH_M = 0.3, 1.5
_ACCELERATION = 4.0  # m/s²
_KP, _KI, _KV = 0.35, 10.0, 12.0  # N m s, N m, 1/s
_NOISE_RAD_PER_S = 0.1
_DRY_M_PER_S = 0.005
_SPOT_M = 0.06
_TEETH = 24
_TOOTH_RAD = 2 * np.pi / _TEETH / 2.355


@dataclass(frozen=True)
class AxisChange:
    """What changes at `start_s`, in steps or over `ramp_s`: factors, and the share that a place at 0.9 m loses.

    `ripple_n_m` is added to the torque, 24 a turn. A worn tooth of the motor's pulley moves the belt by `tooth_m`.
    """

    start_s: float = np.inf
    ramp_s: float = 0.0
    stiffness: float = 1.0
    load: float = 1.0
    damping: float = 1.0
    inertia: float = 1.0
    friction: float = 1.0
    spot: float = 0.0
    ripple_n_m: float = 0.0
    tooth_m: float = 0.0


def reference_m_per_s(seconds: float, generator: np.random.Generator, rate_hz: float = RATE_HZ) -> tuple[float, Floats]:
    """Start and speed at each tick of strokes of random speeds between the ends, with pauses of 0.1 to 0.5 s."""
    start_m = position_m = float(generator.uniform(LOW_M, HIGH_M))
    parts, ticks, end_m = [], 0, HIGH_M
    while ticks < seconds * rate_hz:
        way_m = end_m - position_m
        top = min(float(generator.uniform(0.1, 0.4)), np.sqrt(abs(way_m) * _ACCELERATION))
        rising = np.arange(1, max(int(top / _ACCELERATION * rate_hz), 1) + 1) / rate_hz * _ACCELERATION
        cruise = int(max(abs(way_m) - 2 * rising.sum() / rate_hz, 0.0) / top * rate_hz)
        stroke = np.sign(way_m) * np.concatenate([rising, np.full(cruise, top), rising[::-1]])
        parts += [stroke, np.zeros(int(generator.uniform(0.1, 0.5) * rate_hz))]
        ticks += len(parts[-2]) + len(parts[-1])
        position_m, end_m = position_m + stroke.sum() / rate_hz, LOW_M + HIGH_M - end_m
    return start_m, np.concatenate(parts)[: int(seconds * rate_hz)]


def recordings(
    excitation_n_m: Floats,
    seconds: float,
    seeds: Sequence[int],
    changes: Sequence[AxisChange],
    dry_n: float = 12.0,
    *,
    rate_hz: float = RATE_HZ,
    stribeck_n: float = 0.0,
    counts: int = 0,
) -> list[Block]:
    """One recording of each axis, all of the same length; the excitation repeats.

    With `counts` a turn, the velocity is the difference of an encoder's steps, half a sample late, without other noise.
    """
    generators = [np.random.default_rng(seed) for seed in seeds]
    starts, speeds = zip(*(reference_m_per_s(seconds, g, rate_hz) for g in generators))
    speed, count = np.array(speeds), int(seconds * rate_hz)
    noise = np.array([_NOISE_RAD_PER_S * g.standard_normal(count) for g in generators])
    w = excitation_n_m[np.arange(count) % len(excitation_n_m)]
    state = np.zeros((4, len(seeds)))
    state[0], state[2] = np.array(starts) / R, starts
    integral, wanted = np.zeros(len(seeds)), np.array(starts)
    data = np.empty((len(seeds), len(CHANNELS), count))
    derivative = _equations(changes, dry_n, stribeck_n)
    before = _rounded(state[0], counts)
    for i in range(count):
        velocity = state[1] + noise[:, i]
        if counts:
            now = _rounded(state[0], counts)
            velocity, before = (now - before) * rate_hz, now
        error = speed[:, i] / R + _KV * (wanted / R - state[0]) - velocity
        integral += _KI * error / rate_hz
        torque = _KP * error + integral + w[i]
        data[:, 0, i], data[:, 1, i], data[:, 2, i] = w[i], torque, velocity
        data[:, 3, i] = _rounded(state[0], 1 << 20) * R
        state = _step(derivative(i / rate_hz), state, torque, 1 / rate_hz)
        wanted += speed[:, i] / rate_hz
    return [Block(each, CHANNELS, rate_hz) for each in data]


def _rounded(angle: Floats, counts: int) -> Floats:
    """As an encoder reads it; exact without counts."""
    return np.asarray(np.round(angle * counts / (2 * np.pi)) / counts * 2 * np.pi) if counts else angle


Derivative = Callable[[Floats, Floats], Floats]


def _equations(changes: Sequence[AxisChange], dry_n: float, stribeck_n: float) -> Callable[[float], Derivative]:
    """Of each moment, the derivative of angle, speed, position and speed of the cart under a torque."""
    names = "stiffness", "load", "damping", "inertia", "friction"
    factors = {name: np.array([getattr(c, name) for c in changes]) for name in names}
    others = "start_s", "ramp_s", "spot", "ripple_n_m", "tooth_m"
    start_s, ramp_s, spot, ripple, tooth = (np.array([getattr(c, name) for c in changes]) for name in others)

    def at(time_s: float) -> Derivative:
        with np.errstate(invalid="ignore"):
            share = np.clip((time_s - start_s) / np.maximum(ramp_s, 1e-9), 0.0, 1.0)
        k, m, d, j, f = (1 + share * (factors[name] - 1) for name in names)

        def derivative(state: Floats, torque: Floats) -> Floats:
            angle, omega, x, v = state
            soft = C * k * (1 - share * spot * np.exp(-(((x - 0.9) / _SPOT_M) ** 2) / 2))
            near, far = soft / x, soft / (2 * L3 - x)
            past = (angle + np.pi) % (2 * np.pi) - np.pi
            bump = share * tooth * np.exp(-((past / _TOOTH_RAD) ** 2) / 2)
            slope = bump * past / _TOOTH_RAD**2
            stretch, rate = R * angle + bump - x, (R - slope) * omega - v
            force = (near + far) * stretch + d * (70.0 + 60.0 * np.sqrt((near + far) / 5e5)) * rate
            slow = stribeck_n / (1 + (v / 0.05) ** 2)
            dry = f * ((dry_n + slow) * np.tanh(v / _DRY_M_PER_S) + 2.0 * v)
            motor = f * (0.02 * np.tanh(R * omega / _DRY_M_PER_S) + 5e-4 * omega)
            driving = torque + share * ripple * np.sin(_TEETH * angle) - (R - slope) * force - motor
            return np.array([omega, driving / (j * JS), v, (force - dry) / (m * ML)])

        return derivative

    return at


def _step(derivative: Derivative, state: Floats, torque: Floats, h: float) -> Floats:
    one = derivative(state, torque)
    two = derivative(state + h / 2 * one, torque)
    three = derivative(state + h / 2 * two, torque)
    four = derivative(state + h * three, torque)
    return np.asarray(state + h / 6 * (one + 2 * two + 2 * three + four))
