"""Feedforward from a measurement in the non-linear simulated axis: `python -m studies.tune_feedforward [axes]`.

Inertia from the response at low lines, friction from strokes, both of the axes of `studies.tune_steps`. The torque that
they give for a trapezoid is added in the simulator; the tracking error is compared with that without it. Then the
causes of an error of the inertia are switched on one at a time.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode.core import SignalError
from livebode.motion import friction_curve
from livebode.simulation import BeltAxis, SimulatedAxis, Strokes
from livebode_control.tuning.feedforward import Feedforward, rigid_inertia
from studies.result import Table, Verdict
from studies.tune import show
from studies.tune_steps import RATE_HZ, axes, measured

Floats = NDArray[np.float64]

TRAPEZOID = Strokes(start_m=0.6, end_m=1.2, speed_m_per_s=0.5, acceleration_m_per_s2=5.0, dwell_s=0.3)
SLOWER = Strokes(start_m=0.6, end_m=1.2, speed_m_per_s=0.2, acceleration_m_per_s2=5.0, dwell_s=0.3)
_INSIDE, _RATIO = 0.9, 0.2
CAUSES = {
    "torque noise": ("noise",),
    "torque ripple": ("ripple",),
    "belt that follows": ("belt",),
    "Coulomb friction": ("coulomb",),
    "Coulomb and Stribeck friction": ("coulomb", "stribeck"),
    "all but dry friction": ("noise", "ripple", "belt"),
    "all": ("noise", "ripple", "belt", "coulomb", "stribeck"),
}


@dataclass(frozen=True)
class Tracked:
    """Rms error of the motor's position without and with feedforward; whether the bound covers the inertia."""

    before_rad: float
    after_rad: float
    covered: bool
    inertia_error: float


def found_in(axis: BeltAxis) -> Feedforward:
    """Feedforward from responses at three places, and from strokes at two speeds."""
    curves = []
    for strokes in (TRAPEZOID, SLOWER):
        position, _ = strokes.cycle(RATE_HZ)
        block, _ = SimulatedAxis(replace(axis, motion=strokes, seconds=position.size / RATE_HZ)).run()
        curves.append(block)
    data = np.concatenate([block.data for block in curves], axis=1)
    joined = replace(curves[0], data=data)
    curve = friction_curve(joined, input="u", output="velocity", kind="velocity")
    return Feedforward.of(measured(axis), "velocity", curve)


def tracked(axis: BeltAxis) -> Tracked:
    """The trapezoid with and without the torque of the feedforward."""
    found = found_in(axis)
    _, speed = (row / axis.mechanics.radius_m for row in TRAPEZOID.cycle(RATE_HZ))
    torque = found.torque(speed, np.gradient(speed) * RATE_HZ)
    errors = []
    for added in (np.zeros(1), torque):
        moved = replace(axis, motion=TRAPEZOID, excitation_n_m=added, seconds=speed.size / RATE_HZ)
        block, truth = SimulatedAxis(moved).run()
        errors.append(float(np.sqrt(np.mean((block["position_reference"] - truth.states[0]) ** 2))))
    total = _total_kg_m2(axis)
    return Tracked(*errors, abs(found.inertia - total) <= found.inertia_bound, found.inertia / total - 1)


def compared(count: int, seed: int = 3) -> list[Tracked]:
    """One trapezoid of each axis."""
    found = []
    for axis, _ in zip(axes(seed), range(count)):
        try:
            found.append(tracked(axis))
        except SignalError as error:
            print(error)
    return found


def only(axis: BeltAxis, causes: Sequence[str]) -> BeltAxis:
    """The axis with these causes of an error; encoder, viscous friction and delay as they are."""
    drive, friction = axis.drive, axis.friction
    if "noise" not in causes:
        drive = replace(drive, torque_noise_n_m=0.0)
    if "ripple" not in causes:
        drive = replace(drive, torque_ripple_n_m=0.0)
    if "coulomb" not in causes:
        friction = replace(friction, motor_coulomb_n_m=0.0, load_coulomb_n=0.0)
    if "stribeck" not in causes:
        friction = replace(friction, motor_stribeck_n_m=0.0)
    return replace(axis, drive=drive, friction=friction)


def inertia_errors(causes: Sequence[str], count: int, seed: int = 3) -> tuple[Floats, Floats]:
    """Error of the inertia and its bound over the true inertia, of each axis."""
    found = []
    for axis, _ in zip(axes(seed), range(count)):
        responses = measured(only(axis, causes), constant="belt" not in causes)
        inertia, bound = rigid_inertia(responses, "velocity")
        found.append((inertia / _total_kg_m2(axis) - 1, bound / _total_kg_m2(axis)))
    error, bound = np.array(found).T
    return error, bound


def _total_kg_m2(axis: BeltAxis) -> float:
    return axis.mechanics.inertia_kg_m2 + axis.mechanics.load_kg * axis.mechanics.radius_m**2


def causes_table(count: int) -> Table:
    """Bound and error of the inertia by cause."""
    rows = []
    for name, causes in CAUSES.items():
        error, bound = inertia_errors(causes, count)
        rows.append(
            (
                name, f"{100 * np.mean(np.abs(error) <= bound):.0f} %", f"± {100 * np.median(bound):.2f} %",
                f"{100 * np.median(np.abs(error)):.2f} %", f"{100 * np.mean(error):+.2f} %",
            )
        )  # fmt: skip
    return Table("Inertia by cause", ("causes", "in its bound", "bound", "error", "mean error"), rows)


def main(count: int = 20) -> None:
    found = compared(count)
    ratio = np.array([one.after_rad / one.before_rad for one in found])
    covered = float(np.mean([one.covered for one in found]))
    row = (
        len(found), f"{1e3 * np.median([one.before_rad for one in found]):.1f}",
        f"{1e3 * np.median([one.after_rad for one in found]):.1f}", f"{np.median(ratio):.2f}", f"{ratio.max():.2f}",
        f"{100 * np.median(np.abs([one.inertia_error for one in found])):.2f} %", f"{100 * covered:.0f} %",
    )  # fmt: skip
    header = ("axes", "before, mrad", "after, mrad", "after/before", "worst", "error of inertia", "in its bound")
    show(Table("Rms tracking error of a trapezoid", header, [row]))
    show(causes_table(count))
    print(Verdict("tracking error after/before, median", float(np.median(ratio)), _RATIO, why="measured"))
    print(Verdict("bound of the inertia covers it", covered, _INSIDE, at_least=True, why="measured"))


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
