"""A closed loop tick by tick in which every word of its description can be another one, for many runs at once.

It shares nothing with the simulated axis and with `TwoMassLoop` but the hold of a linear plant.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from livebode.configuration import LoopSection
from livebode.simulation.hold import held

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Drive:
    """The cascade as it runs: rates, gains, integrator rule, hold, delay, filter; and when its signals are logged."""

    rate_hz: float = 4000.0
    gain: float = 0.2308
    integral_time_s: float = 0.2
    integrator: Literal["backward", "forward", "trapezoidal"] = "backward"
    velocity_ticks: int = 1
    position_gain: float = 1.0
    position_ticks: int = 2
    delay_ticks: int = 0
    lowpass_s: float = 0.0
    input_late: bool = False
    excitation_late: bool = False
    output_late: bool = False

    def described(self) -> LoopSection:
        """The description of it."""
        position = {
            "gain": self.position_gain,
            "rate_hz": self.rate_hz / self.position_ticks,
            "rate_divider": self.position_ticks,
        }
        words: dict[str, Any] = {
            "velocity": {
                "gain": self.gain,
                "integral_time_s": self.integral_time_s,
                "rate_hz": self.rate_hz / self.velocity_ticks,
                "rate_divider": self.velocity_ticks,
                "integrator": self.integrator,
                "delay_ticks": self.delay_ticks,
                "lowpass_s": self.lowpass_s,
            },
            "velocity_differenced": True,
            "input_logged": "before" if self.input_late else "after",
            "excitation_logged": "before" if self.excitation_late else "after",
            "output_logged": "after" if self.output_late else "before",
        }
        return LoopSection.model_validate(words | ({"position": position} if self.position_gain else {}))


@dataclass(frozen=True, kw_only=True)
class Machine:
    """Two masses on a shaft, an encoder, cogging, friction and noise; inertias in kg m², stiffness in N m/rad."""

    motor_kg_m2: float = 0.0028
    load_kg_m2: float = 0.0024
    stiffness_n_m: float = 180.0
    damping_n_m_s: float = 0.047
    counts_per_turn: int = 0
    cogging_n_m: float = 0.0
    cogging_per_turn: float = 24.0
    friction_n_m: float = 0.0
    torque_noise_n_m: float = 0.0
    load_noise_n_m: float = 0.0
    angle_noise_rad: float = 0.0
    noise_pole: float = 0.0

    def discrete(self, rate_hz: float) -> tuple[Floats, Floats]:
        """A and b for the states motor angle and speed, load angle and speed, with torque on the motor."""
        j, m, k, b = self.motor_kg_m2, self.load_kg_m2, self.stiffness_n_m, self.damping_n_m_s
        a = np.array(
            [
                [0, 1, 0, 0],
                [-k / j, -b / j, k / j, b / j],
                [0, 0, 0, 1],
                [k / m, b / m, -k / m, -b / m],
            ]
        )
        return held(a, np.array([0, 1 / j, 0, 0]), 1 / rate_hz)


def record(
    drive: Drive,
    machine: Machine,
    w: Floats,
    periods: int,
    runs: int,
    seed: int,
    *,
    settling: int = 10,
    load: Floats | None = None,
) -> tuple[Floats, Floats, Floats]:
    """Logged w (ticks,), u and velocity y (runs, ticks), after so many periods of settling.

    `load` is a further torque on the motor for each tick, settling included, shape (ticks, runs).

    The velocity is the difference of the last two angles, so it has the steps of the encoder, and the position loop
    reads the same angles, in ticks of the velocity loop. Noise has the spectrum of a first-order process with the pole
    `noise_pole`.
    """
    rng = np.random.default_rng(seed)
    plant, into = machine.discrete(drive.rate_hz)
    state = np.zeros((runs, 4))
    angle_before, integral, before, held_speed, filtered = np.zeros((5, runs))
    line = [np.zeros(runs)] * drive.delay_ticks
    noises = np.zeros((3, runs))
    ticks = (periods + settling) * w.size
    u, y, logged = np.empty((ticks, runs)), np.empty((ticks, runs)), np.empty((ticks, runs))
    step = drive.velocity_ticks / drive.rate_hz
    slow = drive.lowpass_s / step
    fresh = np.sqrt(1 - machine.noise_pole**2)
    sizes = np.array([machine.torque_noise_n_m, machine.load_noise_n_m, machine.angle_noise_rad])[:, np.newaxis]
    for n in range(ticks):
        noises = machine.noise_pole * noises + fresh * rng.standard_normal((3, runs))
        torque_noise, load_noise, angle_noise = sizes * noises
        angle = state[:, 0] + angle_noise
        if machine.counts_per_turn:
            angle = np.round(angle * machine.counts_per_turn / (2 * np.pi)) * (2 * np.pi / machine.counts_per_turn)
        speed = (angle - angle_before) * drive.rate_hz
        angle_before = angle
        if n % drive.position_ticks == 0:
            held_speed = -drive.position_gain * angle
        if n % drive.velocity_ticks == 0:
            error = held_speed - speed
            if drive.integrator == "backward":
                integral = integral + step * error
            elif drive.integrator == "trapezoidal":
                integral = integral + step * (error + before) / 2
            control = drive.gain * (error + integral / drive.integral_time_s)
            if drive.integrator == "forward":
                integral = integral + step * error
            before = error
            filtered = (slow * filtered + control) / (1 + slow)
        line.append(filtered)
        torque = line.pop(0) + w[n % w.size]
        logged[n], y[n], u[n] = torque + torque_noise, speed, torque
        acting = torque + machine.cogging_n_m * np.sin(machine.cogging_per_turn * state[:, 0])
        acting = acting - machine.friction_n_m * np.tanh(state[:, 1] / 0.05)
        acting = acting if load is None else acting + load[n]
        state = state @ plant.T + np.multiply.outer(acting + load_noise, into)
    late = [settling * w.size - by for by in (drive.excitation_late, drive.input_late, -drive.output_late)]
    first = settling * w.size
    count = ticks - first - 1
    rows = [np.resize(w, ticks), logged.T, y.T]
    w_logged, u_logged, y_logged = (row[..., at : at + count] for row, at in zip(rows, late))
    return w_logged, u_logged, y_logged
