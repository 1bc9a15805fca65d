"""Conversion of the described controllers to a drive that can be simulated."""

from __future__ import annotations

import numpy as np

from livebode.core import PID, Cascade, Loop, SimulationError
from livebode.simulation import Drive


def drive_of(loop: Loop, rate_hz: float) -> Drive:
    """The described controllers as parameters of the simulation.

    Raises
    ------
    SimulationError
        If the feedback is not a P or PI velocity controller with backward integrator, alone or under a P position
        controller (a `Cascade`), if the excitation does not enter at the torque, or rates do not divide.
    """
    velocity, position = _controllers(loop)
    ticks = velocity.rate_divider * (position.rate_divider if position else 1)
    return Drive(
        rate_hz=rate_hz,
        velocity_rate_hz=rate_hz / velocity.rate_divider,
        position_rate_hz=rate_hz / ticks,
        velocity_gain_n_m_s=velocity.gain,
        integral_time_s=min(velocity.integral_time_s, 1e12),
        position_gain_per_s=position.gain if position else 0.0,
        velocity_feedforward=0.0,
        delay_ticks=velocity.delay_ticks,
    )


def _controllers(loop: Loop) -> tuple[PID, PID | None]:
    given = loop.feedback
    cascade = given if isinstance(given, Cascade) else None
    feedback, position = (cascade.velocity, cascade.position) if cascade else (given, None)
    if not isinstance(feedback, PID) or not (position is None or isinstance(position, PID)):
        raise SimulationError(
            "loop-unsupported",
            f"a loop with a feedback of type {type(given).__name__} cannot be simulated",
            "describe the feedback as Cascade(velocity=PID(...), position=PID(...)) or a PID on the velocity, or drive "
            "the model by 'torque'",
            key="loop.feedback",
        )
    if feedback.derivative_time_s or (np.isfinite(feedback.integral_time_s) and feedback.integrator != "backward"):
        raise SimulationError(
            "loop-unsupported",
            "only P and PI velocity controllers with a backward integrator can be simulated",
            "drive the model by 'torque'",
            key="loop.feedback",
        )
    if position is not None and (
        position.derivative_time_s or np.isfinite(position.integral_time_s) or position.delay_ticks
    ):
        raise SimulationError(
            "loop-unsupported",
            "only P position controllers without a delay of their own can be simulated",
            "drive the model by 'torque'",
            key="loop.feedback",
        )
    if loop.entry is not None:
        raise SimulationError(
            "loop-unsupported",
            "only an excitation that is added to the torque reference can be simulated",
            "drive the model by 'torque'",
            key="loop.entry",
        )
    return feedback, position
