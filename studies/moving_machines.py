"""Random axes with friction, play, cogging and coarse encoders, many at once: a simulator of another make than ours.

Two masses on a belt with play, under a cascade, semi-implicit Euler with a few substeps to a tick. Its own linear part
is its truth, so that the integration adds no error.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from livebode import Lines, multisine
from livebode.core import Block, Channel

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_SUBSTEPS = 4
_SLIP_M_PER_S = 2e-3  # over which the sign of a friction is smoothed
_START_M, _STROKE_M, _HALF_BELT_M, _NOMINAL_M = 0.4, 0.8, 2.14, 0.6


@dataclass(frozen=True)
class Machines:
    """Constants of axes, each of shape (machines,); `amplitude` and `friction` are in N m at the motor."""

    inertia: Floats
    radius_m: Floats
    load_kg: Floats
    stiffness: Floats
    damping: Floats
    varies: Floats  # 1 where the stiffness follows the position
    gain: Floats
    integral_s: Floats
    position_gain: Floats
    speed_m_per_s: Floats
    amplitude: Floats  # of a line
    motor_friction: Floats
    load_friction: Floats
    stribeck: Floats  # share of the friction that is added near standstill
    play_m: Floats
    noise: Floats
    force_noise: Floats
    cogging: Floats
    teeth: Floats
    delay: NDArray[np.int64]
    counts: Floats  # of the encoder, a turn; 0: exact
    drift: Floats  # of the stiffness over the record

    def __len__(self) -> int:
        return self.inertia.size

    def one(self, i: int) -> Machines:
        return Machines(*(getattr(self, field.name)[i : i + 1] for field in fields(self)))

    def shape(self, position_m: Floats, share: float | Floats) -> Floats:
        """Stiffness relative to the nominal one."""
        at = 1 / position_m + 1 / (2 * _HALF_BELT_M - position_m)
        nominal = 1 / _NOMINAL_M + 1 / (2 * _HALF_BELT_M - _NOMINAL_M)
        return np.asarray(np.where(self.varies > 0, at / nominal, 1.0) * (1 + self.drift * share))


def drawn(rng: np.random.Generator, lines: list[Lines], friction: bool, play: bool) -> Machines:
    """One machine for each lines; the excitation moves it with 0.1 … 1.2 times (rms) its speed."""
    many = len(lines)

    def between(low: float, high: float) -> Floats:
        return np.exp(rng.uniform(np.log(low), np.log(high), many))

    def some(chance: float, values: Floats) -> Floats:
        return np.where(rng.random(many) < chance, values, 0.0)

    js, r = between(8e-4, 4e-3), between(0.015, 0.03)
    load = between(0.8, 4.0) * js / r**2
    total, reduced = js + load * r**2, js * load / (js + load * r**2)
    stiffness = (2 * np.pi * between(40, 100)) ** 2 * reduced
    bandwidth, speed, share = 2 * np.pi * between(8, 30), between(0.04, 0.4), between(0.1, 1.2)
    nothing = np.zeros(many)
    at_motor, at_load = (between(0.03, 0.4) * friction for _ in range(2))
    where = rng.integers(0, 3, many)  # motor, load, both
    values = {
        "inertia": js, "radius_m": r, "load_kg": load, "stiffness": stiffness,
        "damping": 2 * between(0.03, 0.1) * np.sqrt(stiffness * reduced),
        "varies": rng.integers(0, 2, many).astype(float),
        "gain": bandwidth * total, "integral_s": 4 / bandwidth * between(0.7, 1.5), "position_gain": bandwidth / 4,
        "speed_m_per_s": speed, "amplitude": np.ones(many), "motor_friction": np.where(where != 1, at_motor, 0.0),
        "load_friction": np.where(where != 0, at_load, 0.0), "stribeck": some(0.3, between(0.2, 1.0)),
        "play_m": between(2e-6, 40e-6) * play, "noise": between(3e-3, 0.05) * share * speed / r,
        "force_noise": between(3e-3, 0.03), "cogging": some(0.3, between(0.01, 0.1)),
        "teeth": rng.integers(3, 30, many).astype(float), "delay": rng.integers(0, 3, many),
        "counts": some(0.25, 2.0 ** rng.integers(17, 22, many)), "drift": some(0.2, rng.uniform(-0.03, 0.03, many)),
    }  # fmt: skip
    unit = Machines(**values | {"motor_friction": nothing, "load_friction": nothing, "play_m": nothing})
    amplitude = share * speed / np.array([_speed_of(unit.one(i), lines[i]) for i in range(many)])
    rms = amplitude * np.sqrt(np.array([len(own) / 2 for own in lines]))
    of_excitation = {name: values[name] * rms for name in ("motor_friction", "load_friction")}
    of_line = {name: values[name] * amplitude for name in ("force_noise", "cogging")}
    return Machines(**values | of_excitation | of_line | {"amplitude": amplitude})


def _speed_of(machine: Machines, lines: Lines) -> float:
    """Speed of the belt, m/s rms, for lines of 1 N m."""
    plant = truth(machine, lines, np.array([_NOMINAL_M]), np.array([0.5]))[0]
    feedback = machine.gain * (1 + 1 / (machine.integral_s * 2j * np.pi * lines.frequency_hz))
    return float(np.sqrt(np.sum(np.abs(plant / (1 + plant * feedback)) ** 2) / 2) * machine.radius_m[0])


def truth(machine: Machines, lines: Lines, position_m: Floats, share: Floats) -> Complex:
    """Linear response of one machine at positions and shares of the record, exact, (positions, lines)."""
    h, (js,), (r,), (load,) = 1 / lines.rate_hz / _SUBSTEPS, machine.inertia, machine.radius_m, machine.load_kg
    found = np.empty((position_m.size, len(lines)), dtype=np.complex128)
    for row, (x, s) in enumerate(zip(position_m, share)):
        scale = float(machine.shape(np.array([x]), s)[0])
        k, b = machine.stiffness[0] * scale, machine.damping[0] * np.sqrt(scale)
        # States: stretch, motor, cart, angle. Speeds change first, then positions by the new speeds.
        speeds = np.eye(4)
        speeds[1, :3] += h * np.array([-r * k, -r * r * b, r * b]) / js
        speeds[2, :3] += h * np.array([k, r * b, -b]) / load
        places = np.eye(4)
        places[0, 1:3], places[3, 1] = (h * r, -h), h
        step, kick = places @ speeds, places @ np.array([0, h / js, 0, 0])
        whole, torque = np.eye(4), np.zeros(4)
        for _ in range(_SUBSTEPS):
            whole, torque = step @ whole, step @ torque + kick
        inverse = lines.z[:, np.newaxis, np.newaxis] * np.eye(4) - whole
        states = np.linalg.solve(inverse, np.tile(torque[:, np.newaxis], (len(lines), 1, 1)))
        angle = (1 - 1 / lines.z) * lines.rate_hz * states[:, 3, 0]
        found[row] = (angle if machine.counts[0] else states[:, 1, 0]) * lines.z ** -float(machine.delay[0])
    return found


def recorded(machines: Machines, lines: list[Lines], seconds: float, rng: np.random.Generator) -> list[Block]:
    """Channels w, u, y (rad/s) and x (m) of each machine over strokes of up to 2.5 s."""
    m, rate, window = machines, lines[0].rate_hz, lines[0].window
    many, ticks = len(m), round(seconds * rate) // window * window
    periods = [multisine(own, phases="random", seed=int(rng.integers(1 << 30))) for own in lines]
    w = np.tile(np.array(periods).T, (ticks // window, 1))
    w = w * m.amplitude
    speed, reference = _strokes(m.speed_m_per_s, ticks, rate)
    noise, force = (size * rng.standard_normal((ticks, many)) for size in (m.noise, m.force_noise))
    found = np.empty((3, ticks, many))
    angle, cart = np.full(many, _START_M) / m.radius_m, np.full(many, _START_M)
    motor, velocity, integral = (np.zeros(many) for _ in range(3))
    late, h = [np.zeros(many)] * 3, 1 / rate / _SUBSTEPS
    steps = np.where(m.counts > 0, 2 * np.pi / np.maximum(m.counts, 1), 1.0)
    before = np.floor(angle / steps)
    for k in range(ticks):
        counted = np.floor(angle / steps)
        late = [np.where(m.counts > 0, (counted - before) * steps * rate, motor) + noise[k], *late[:2]]
        before, y = counted, np.choose(m.delay, late)
        error = m.position_gain * (reference[k] / m.radius_m - angle) + speed[k] / m.radius_m - y
        integral = integral + error / rate / m.integral_s
        u = m.gain * (error + integral) + w[k]
        found[:, k] = u, y, angle * m.radius_m
        torque = u + force[k] + m.cogging * np.sin(m.teeth * angle)
        scale = m.shape(cart, k / ticks)
        stiffness, damping = m.stiffness * scale, m.damping * np.sqrt(scale)
        for _ in range(_SUBSTEPS):
            stretch = m.radius_m * angle - cart
            stretch = np.sign(stretch) * np.maximum(np.abs(stretch) - m.play_m / 2, 0.0)
            belt = stiffness * stretch + damping * (m.radius_m * motor - velocity) * (stretch != 0)
            at_motor = m.motor_friction * _dry(m.radius_m * motor, m.stribeck)
            at_load = m.load_friction / m.radius_m * _dry(velocity, m.stribeck)
            motor = motor + h * (torque - m.radius_m * belt - at_motor) / m.inertia
            velocity = velocity + h * (belt - at_load) / m.load_kg
            angle, cart = angle + h * motor, cart + h * velocity
    channels = (Channel("w", "N m"), Channel("u", "N m"), Channel("y", "rad/s"), Channel("x", "m"))
    return [Block(np.vstack([w[:, i], found[:, :, i]]), channels, rate) for i in range(many)]


def _dry(speed: Floats, stribeck: Floats) -> Floats:
    return np.asarray(np.tanh(speed / _SLIP_M_PER_S) * (1 + stribeck * np.exp(-((speed / 0.02) ** 2))))


def _strokes(speed: Floats, ticks: int, rate: float) -> tuple[Floats, Floats]:
    """Speed and position of trapezoidal strokes without dwells, (ticks, machines)."""
    rise = np.maximum(speed / 0.1, 1.0)
    half = np.minimum(_STROKE_M, 2.5 * speed) / speed + speed / rise
    phase = (np.arange(ticks) / rate)[:, np.newaxis] % (2 * half)
    within, sign = phase % half, np.where(phase < half, 1.0, -1.0)
    now = sign * np.minimum(np.minimum(within, half - within) * rise, speed)
    return now, _START_M + np.cumsum(now, axis=0) / rate
