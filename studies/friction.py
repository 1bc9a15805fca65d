"""Known friction of the simulated axis, and how often its bounds contain it.

python -m studies.friction [runs] [part of the cases' names]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.motion import FrictionCurve, friction_curve
from livebode.simulation import BeltAxis, Drive, Friction, Mechanics, Sensor, SimulatedAxis, StrokeSequence

PROBABILITIES = (0.632, 0.982)
RUNS = 400
RADIUS_M = Mechanics().radius_m
STROKES = StrokeSequence(
    turning_points_m=(0.3, 0.55, 0.3, 0.55, 0.3, 0.55, 0.3, 0.55, 0.3),
    speeds_m_per_s=(0.05, 0.05, 0.1, 0.1, 0.2, 0.2, 0.4, 0.4),
)
SLIDING = Friction(load_coulomb_n=15.0, load_viscous_n_s_per_m=40.0, smoothing_m_per_s=1e-4)
STRIBECK = Friction(
    load_coulomb_n=15.0, load_viscous_n_s_per_m=40.0, load_stribeck_n=10.0, stribeck_speed_m_per_s=0.1,
    smoothing_m_per_s=1e-4,
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """An axis: its friction and strokes, the noise of its torque and velocity, and its encoder."""

    friction: Friction
    strokes: StrokeSequence = STROKES
    torque_noise_n_m: float = 0.1
    noise_rad_per_s: float = 0.1
    encoder_counts_per_turn: int = 1 << 14


OTHER_STROKES = StrokeSequence(
    turning_points_m=(0.3, 0.7, 0.35, 0.6, 0.3, 0.65, 0.3, 0.6, 0.3),
    speeds_m_per_s=(0.3, 0.3, 0.08, 0.08, 0.15, 0.15, 0.12, 0.5),
)
CASES = {
    "Coulomb and viscous": Case(SLIDING),
    "with Stribeck": Case(STRIBECK),
    "Coulomb and viscous, other axis": Case(SLIDING, OTHER_STROKES, 0.2, 0.05, 1 << 11),
    "with Stribeck, other axis": Case(STRIBECK, OTHER_STROKES, 0.2, 0.05, 1 << 11),
}


def measured(case: Case, seed: int) -> FrictionCurve:
    """The curve of a recording of 22 s with noise of the torque and a coarse encoder."""
    axis = BeltAxis(
        motion=case.strokes,
        friction=case.friction,
        drive=Drive(torque_noise_n_m=case.torque_noise_n_m),
        sensor=Sensor(noise_rad_per_s=case.noise_rad_per_s, encoder_counts_per_turn=case.encoder_counts_per_turn),
        seconds=22.0,
        seed=seed,
    )
    block, _ = SimulatedAxis(axis).run()
    return friction_curve(block, input="u", output="velocity", kind="velocity")


def truth(friction: Friction) -> dict[str, float]:
    """The parameters at the motor."""
    mechanics = Mechanics()
    return {
        "inertia": mechanics.inertia_kg_m2 + mechanics.load_kg * RADIUS_M**2,
        "viscous": friction.load_viscous_n_s_per_m * RADIUS_M**2,
        "offset": 0.0,
        "coulomb": friction.load_coulomb_n * RADIUS_M,
        "stribeck": friction.load_stribeck_n * RADIUS_M,
        "stribeck_speed": friction.stribeck_speed_m_per_s / RADIUS_M,
    }


def within(found: FrictionCurve, true: dict[str, float]) -> NDArray[np.bool_]:
    """Whether each parameter is within its bound of each probability, (probabilities, parameters)."""
    error = np.abs(found.value - np.array([true[name] for name in found.names]))
    return np.array([error <= found.bound(p) for p in PROBABILITIES])


def main(runs: int, part: str = "") -> int:
    for name, case in CASES.items():
        if part not in name:
            continue
        curves = [measured(case, seed) for seed in range(runs)]
        names = max((curve.names for curve in curves), key=len)
        whole = [curve for curve in curves if curve.names == names]
        true = truth(case.friction)
        share = np.mean([within(curve, true) for curve in whole], axis=0)
        value = np.array([curve.value for curve in whole])
        bound = np.mean([curve.bound() for curve in whole], axis=0)
        print(f"{name}: {len(whole)} of {runs} runs found all of {', '.join(names)}")
        print(f"{'':16}{'true':>10}{'mean':>10}{'± 95 %':>10}{'bias/sigma':>12}{'in 63.2 %':>11}{'in 98.2 %':>11}")
        for i, parameter in enumerate(names):
            bias = (value[:, i].mean() - true[parameter]) / value[:, i].std()
            shares = "".join(f"{100 * one:>9.1f} %" for one in share[:, i])
            print(
                f"{parameter:16}{true[parameter]:>10.4g}{value[:, i].mean():>10.4g}{bound[i]:>10.2g}{bias:>12.2f}"
                + shares
            )
        print(f"{'mean':58}" + "".join(f"{100 * one:>9.1f} %" for one in share.mean(axis=1)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if sys.argv[1:] else RUNS, *sys.argv[2:3]))
