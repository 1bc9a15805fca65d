"""The equations of motion of the simulated axis, integrated by another method over a stroke."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from livebode.core import Block, Lines
from livebode.excitation import multisine
from livebode.simulation import BeltAxis, Friction, Mechanics, SimulatedAxis, Strokes, Truth

RATE_HZ = 4000.0
MULTISINE = multisine(Lines.parse("20:140:20", rate_hz=RATE_HZ, window=400))
FRICTION = Friction(motor_coulomb_n_m=0.1, motor_viscous_n_m_s=1e-3, load_coulomb_n=15.0, load_viscous_n_s_per_m=3.0,
                    load_stribeck_n=5.0)  # fmt: skip
# Table I, written out once more.
JS, JP, ML, R, L3 = 0.0028, 1.8e-4, 6.7, 0.019, 2.14
C = 5.0e5 / (1 / 0.8 + 1 / (2 * L3 - 0.8))


def damping(x: float) -> float:
    """bs(x), from 130 N s/m at 0.8 m and a constant quality factor."""
    return 130.0 * np.sqrt(C * (1 / x + 1 / (2 * L3 - x)) / 5.0e5)


def dry(coulomb: float, stribeck: float, v: float) -> float:
    return (coulomb + stribeck / (1 + (v / 0.05) ** 2)) * v / np.sqrt(v**2 + 0.01**2)


def resisting(omega: float, v: float, on: bool) -> tuple[float, float]:
    if not on:
        return 0.0, 0.0
    return 1e-3 * omega + dry(0.1, 0.0, R * omega), 3.0 * v + dry(15.0, 5.0, v)


def two_masses(torque: float, s: np.ndarray, rubbing: bool) -> list[float]:
    """(11), (12)."""
    phi, omega, x, v = s
    tau, force = resisting(omega, v, rubbing)
    k1, k23 = C / x, C / (2 * L3 - x)
    belt = (k1 + k23) * (R * phi - x) + damping(x) * (R * omega - v)
    return [omega, (torque - R * belt - tau) / JS, v, (belt - force) / ML]


def three_masses(torque: float, s: np.ndarray, rubbing: bool) -> list[float]:
    """(8)–(10), each span damped in proportion to its stiffness."""
    phi1, omega1, phi2, omega2, x, v = s
    tau, force = resisting(omega1, v, rubbing)
    k1, k2, k3 = C / x, C / (L3 - x), C / L3
    share = damping(x) / (k1 + k2 * k3 / (k2 + k3))
    one = k1 * ((R * phi1 - x) + share * (R * omega1 - v))
    two = k2 * ((x - R * phi2) + share * (v - R * omega2))
    three = k3 * R * ((phi2 - phi1) + share * (omega2 - omega1))
    return [
        omega1, (torque - tau - R * one + R * three) / (JS - JP),
        omega2, (R * two - R * three) / JP,
        v, (one - two - force) / ML,
    ]  # fmt: skip


def integrated(equations: Callable, method: str, block: Block, truth: Truth, rubbing: bool) -> np.ndarray:
    """The states at the ticks under the logged torque, each tick by solve_ivp, from the first state on alone."""
    states = [truth.states[:, 0]]
    for torque in block["u"][:-1]:
        done = solve_ivp(
            lambda _, s, u=torque: equations(u, s, rubbing), (0, 1 / RATE_HZ), states[-1], method=method, rtol=1e-11,
            atol=1e-14, first_step=1 / RATE_HZ / 4,
        )  # fmt: skip
        states.append(done.y[:, -1])
    return np.array(states).T


def stroke_error(masses: int, rubbing: bool, method: str, motion: Strokes) -> float:
    """Largest difference over dwell, stroke and dwell under the multisine, relative to each state's largest value."""
    position, _ = motion.cycle(RATE_HZ)
    axis = BeltAxis(
        mechanics=Mechanics(masses=masses), friction=FRICTION if rubbing else Friction(), motion=motion,
        excitation_n_m=MULTISINE, seconds=(len(position) // 2 + 80) / RATE_HZ,
    )  # fmt: skip
    block, truth = SimulatedAxis(axis).run()
    reference = integrated(two_masses if masses == 2 else three_masses, method, block, truth, rubbing)
    size = np.max(np.abs(reference), axis=1, keepdims=True)
    return float(np.max(np.abs(truth.states - reference) / size))
