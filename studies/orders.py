"""A known torque ripple, and how often its bounds contain it.

python -m studies.orders [runs] [part of the cases' names]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace

import numpy as np

from livebode import Lines, multisine
from livebode.motion import Shaft
from livebode.simulation import BeltAxis, Drive, Friction, Mechanics, Sensor, SimulatedAxis, Strokes, StrokeSequence
from livebode_control.strokes.motion_samples import MotionSamples
from livebode_control.strokes.orders import OrderReport, orders_of

RUNS = 100
RATE_HZ = 4000.0
RIPPLE_N_M, PER_TURN = 0.05, 24
SHAFT = Shaft("motor", 1.0, (1, 2, 12, 23, 24, 25, 48))
LINES = Lines.parse("20:140:20", RATE_HZ, 400)
THERE_AND_BACK = (0.3, 0.8, 0.3, 0.8, 0.3, 0.8, 0.3)


@dataclass(frozen=True)
class Case:
    """A motion, a ripple, an excitation that runs at the same time, and the eccentricity of the encoder.

    Each torque is recorded `late_samples` late, beside a later motion; negative: the motion is late.
    """

    motion: StrokeSequence | Strokes
    ripple_n_m: float = RIPPLE_N_M
    excitation_n_m: float = 0.0
    eccentricity_rad: float = 0.0
    late_samples: int = 0


def _sequence(*speeds_m_per_s: float) -> StrokeSequence:
    return StrokeSequence(turning_points_m=THERE_AND_BACK, speeds_m_per_s=speeds_m_per_s)


SLOW_RAMPS = Strokes(start_m=0.3, end_m=0.8, speed_m_per_s=0.22, acceleration_m_per_s2=0.1)
CASES = {
    "one speed": Case(_sequence(*[0.15] * 6)),
    "three speeds": Case(_sequence(0.1, 0.1, 0.15, 0.15, 0.2, 0.2)),
    "always accelerating": Case(SLOW_RAMPS),
    "the same, three times the ripple": Case(SLOW_RAMPS, ripple_n_m=3 * RIPPLE_N_M),
    "three speeds, excited": Case(_sequence(0.1, 0.1, 0.15, 0.15, 0.2, 0.2), excitation_n_m=0.2),
    "always accelerating, excited": Case(SLOW_RAMPS, excitation_n_m=0.2),
    **{
        f"three speeds, {abs(samples) / 4:g} ms late": Case(
            _sequence(0.1, 0.1, 0.15, 0.15, 0.2, 0.2), late_samples=samples
        )
        for samples in (2, 4, 8)
    },
    "three speeds, motion 0.5 ms late": Case(_sequence(0.1, 0.1, 0.15, 0.15, 0.2, 0.2), late_samples=-2),
}

ECCENTRIC = Case(_sequence(0.15, 0.15, 0.3, 0.3, 0.3, 0.3), eccentricity_rad=0.02)


def measured(case: Case, seed: int) -> OrderReport:
    """Orders of a stiff axis with friction, noise of the torque and of the velocity, in 25 s."""
    axis = BeltAxis(
        mechanics=Mechanics(stiffness_n_per_m=2e8, damping_n_s_per_m=2000.0, frozen_position_m=0.8),
        motion=case.motion,
        excitation_n_m=case.excitation_n_m * multisine(LINES),
        friction=Friction(load_coulomb_n=15.0, load_viscous_n_s_per_m=40.0, smoothing_m_per_s=1e-4),
        drive=Drive(torque_ripple_n_m=case.ripple_n_m, torque_ripple_per_turn=PER_TURN, torque_noise_n_m=0.1),
        sensor=Sensor(noise_rad_per_s=0.02, encoder_eccentricity_rad=case.eccentricity_rad),
        seconds=25.0,
        seed=seed,
    )
    block, _ = SimulatedAxis(axis).run()
    torque, late = block.index("u"), case.late_samples
    data = block.data[:, max(late, 0) : len(block) + min(late, 0)].copy()
    data[torque] = block.data[torque, max(-late, 0) :][: data.shape[1]]
    block = replace(block, data=data)
    samples = MotionSamples(block, "u", "velocity", "velocity", len(block), None, {})
    lines_hz = LINES.frequency_hz if case.excitation_n_m else None
    return orders_of(samples, [SHAFT], angle="position", lines_hz=lines_hz)


def truth(case: Case) -> np.ndarray:
    """Complex amplitudes: the simulated ripple is a sine."""
    return np.array([-1j * case.ripple_n_m if order == PER_TURN else 0.0 for order in SHAFT.orders])


def main(runs: int, part: str = "") -> int:
    at = SHAFT.orders.index(PER_TURN)
    print(f"ripple of {RIPPLE_N_M} N m, {PER_TURN} a turn; {runs} runs each")
    print(
        f"{'':34}{'found':>8}{'± 95 %':>9}{'in 63.2 %':>11}{'in 98.2 %':>11}{'seen':>7}{'false':>7}{'24 in 98.2 %':>14}"
        f"{'with delay':>12}"
    )
    for name, case in CASES.items():
        if part not in name:
            continue
        found = [measured(case, seed).shafts[0] for seed in range(runs)]
        error = np.array([np.abs(one.value - truth(case)) for one in found])
        known = np.isfinite(error)
        shares = [100 * np.mean((error <= [one.bound(c) for one in found])[known]) for c in (1, 2)]
        bounds = np.array([one.bound(2)[at] for one in found])
        delayed = bounds + np.array([one.per_delay_s[at] for one in found]) * abs(case.late_samples) / RATE_HZ
        ripple_share, delayed_share = (100 * np.mean(error[:, at] <= each) for each in (bounds, delayed))
        seen = np.array([one.seen for one in found])
        amplitude, bound = (np.nanmean([one[at] for one in each]) for each in (
            [one.amplitude for one in found], [one.bound() for one in found],
        ))  # fmt: skip
        print(
            f"{name:34}{amplitude:>8.4f}{bound:>9.4f}{shares[0]:>9.0f} %{shares[1]:>9.0f} %"
            f"{100 * seen[:, at].mean():>5.0f} %{100 * np.delete(seen, at, axis=1).mean():>5.1f} %"
            f"{ripple_share:>12.0f} %{delayed_share:>10.0f} %",
            flush=True,
        )
    if part in "eccentric encoder":
        _print_eccentric(runs)
    return 0


def _print_eccentric(runs: int) -> None:
    """The position error of an eccentric encoder, as an error of order 1 that grows with the square of the speed."""
    found = [measured(ECCENTRIC, seed).errors[0] for seed in range(runs)]
    true = np.array([-1j * ECCENTRIC.eccentricity_rad] + [0.0] * (len(SHAFT.orders) - 1))
    error = np.array([np.abs(one.value - true) for one in found])
    shares = [100 * np.mean(error <= [one.bound(c) for one in found]) for c in (1, 2)]
    seen = np.array([one.seen for one in found])
    print(f"\neccentric encoder, {ECCENTRIC.eccentricity_rad} rad, at two speeds; {runs} runs")
    print(
        f"found {np.mean([abs(one.value[0]) for one in found]):.4f} ± {np.mean([one.bound()[0] for one in found]):.4f}"
    )
    print(f"in 63.2 %: {shares[0]:.0f} %, in 98.2 %: {shares[1]:.0f} %")
    print(f"seen: {100 * seen[:, 0].mean():.0f} %, other orders: {100 * seen[:, 1:].mean():.1f} %")


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if sys.argv[1:] else RUNS, *sys.argv[2:3]))
