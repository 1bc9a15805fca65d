"""The Machine of a BeltAxis: exact linear responses along its way, and its motion's own peaks from a simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.simulation import BeltAxis, Sampled, SimulatedAxis
from livebode_design.machine import STANDSTILL, Extremes, Machine, OperatingPoint, Quantity, check_noise
from livebode_design.reversal import slowest_stroke

_PLACES = 9
_STANDSTILL_S = 2.0  # of the simulation that finds the effect of the noise alone
_DRY = "dry friction is not included: at standstill the axis moves less than predicted, and its responses are biased"


def belt_machine(axis: BeltAxis) -> Machine:
    """The Machine that `axis` is, with its friction, noise and motion but without its own excitation.

    Nine places along the motion's travel, or the one of the standstill. The motion's own peaks are those of a second
    cycle, simulated without excitation, because the first one begins at rest and has smaller peaks. Not included: the
    effect of the excitation on dry friction, and the images due to the slower loops (1e-6).
    """
    check_noise(axis.sensor.noise_rad_per_s)
    quiet = replace(axis, excitation_n_m=np.zeros(0), faults=(), run_in_s=0.0)
    position_m, speed_m_per_s = axis.motion.cycle(axis.drive.rate_hz)
    moves = position_m.size > 1
    low, high = float(position_m.min()), float(position_m.max())
    at_m = np.linspace(low, high, _PLACES) if moves else np.array([low])
    seconds = position_m.size / axis.drive.rate_hz if moves else _STANDSTILL_S
    block, truth = SimulatedAxis(replace(quiet, seconds=(1 + moves) * seconds)).run()
    radius, again = axis.mechanics.radius_m, moves * position_m.size
    observed: dict[Quantity, Floats] = {
        "torque": block["u"][again:],
        "speed": truth.states[1, again:] * radius,
        "travel": truth.position_m[again:],
        "following error": (block["position_reference"] - truth.states[0])[again:] * radius,
    }
    nearest = np.argmin(np.abs(observed["travel"][:, np.newaxis] - at_m), axis=1)
    places = [_place(quiet, float(x), _extremes(observed, nearest == i, float(x))) for i, x in enumerate(at_m)]
    return Machine(
        places=tuple(places),
        loop=axis.drive.loop(velocity_differenced=axis.sensor.velocity_differenced),
        rate_hz=axis.drive.rate_hz,
        noise=axis.sensor.noise_rad_per_s,
        stroke_s=seconds / 2 if moves else None,
        encoder_step_m=radius * axis.sensor.encoder_step_rad,
        notes=(_DRY,) if axis.friction.dry and not moves else (),
        slowest_m_per_s=slowest_stroke(speed_m_per_s),
    )


def _extremes(observed: dict[Quantity, Floats], here: NDArray[np.bool_], at_m: float) -> Extremes:
    if (
        not here.any()
    ):  # a place that the cart never approached within half the distance to the next: as at standstill there
        return STANDSTILL | {"travel": (at_m, at_m)}
    return {name: (float(x[here].min()), float(x[here].max())) for name, x in observed.items()}


def _place(axis: BeltAxis, at_m: float, motion: Extremes) -> OperatingPoint:
    linear, rate_hz, radius = axis.linear(at_m), axis.drive.rate_hz, axis.mechanics.radius_m
    velocity, angle = linear.sampled(rate_hz), linear.out("position").sampled(rate_hz)
    differenced = Sampled(angle.a, angle.b, angle.c, rate_hz, differenced=True)
    return OperatingPoint(
        plant=differenced if axis.sensor.velocity_differenced else velocity,
        speed=radius * velocity,
        travel=linear.out("cart").sampled(rate_hz),
        angle=radius * angle,
        motion=motion,
        name=f"cart at {at_m:.3g} m",
    )
