"""Replay of a model through the recorded torque, and its residual."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import PID, Block, Cascade, Channel, Loop, Responses, SimulationError, Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.estimation import Settings, Tracker
from livebode.kernel import BeltCourse, BeltMasses, belt_replay
from livebode.motion.chunk import Chunk
from livebode.motion.model import MovingModel
from livebode.simulation import BeltAxis, Drive, Engine, Mechanics, Standstill, engine_settings
from livebode.simulation import late as _late

_PLACE_M = 1.0  # where the small motion is simulated; the spans are set tick by tick
_INPUTS = 10
_STATES = 4
_ANYWHERE_M = 1e12  # the replay follows the recorded torque, and no end of travel may stop it


def by_torque(model: MovingModel, rate_hz: float, u: Floats, position_m: Floats) -> tuple[Floats, Floats]:
    """Velocities of motor (rad/s) and cart (m/s) under the measured torque u, N m, from rest, shape (samples,) each.

    Torque of any origin (excitation, motion, the controllers' response to noise) moves the model as it moved the
    machine. Effects that are not in u or not in the model, such as friction, make it drift slowly; see `without_drift`.
    """
    masses = BeltMasses(model.inertia_kg_m2, model.load_kg, model.radius_m)
    course = BeltCourse(rate_hz, model.stiffness_at(position_m), model.damping_at(position_m), np.ascontiguousarray(u))
    motor, cart = belt_replay(masses, course)
    if not np.isfinite(cart[-1]):  # what is not finite remains so until the end
        raise SimulationError(
            "diverged",
            "the fitted model diverges under the measured torque",
            "check the signals and their units, and the radius",
            sample=int(np.argmin(np.isfinite(cart))),
        )
    return late(motor, model.delay_s * rate_hz), cart


def by_excitation(model: MovingModel, drive: Drive, w: Floats, position_m: Floats) -> tuple[Floats, Floats]:
    """u, N m, and velocity, rad/s, of the model's loop under w alone, from rest, shape (samples,) each.

    The motion itself is excluded: the rest is linear and time-varying. It does not include transients after an
    acceleration of the reference. The loop is closed over the velocity without the model's delay, which is
    in the result alone.
    """
    stiffness, damping = model.stiffness_at(position_m), model.damping_at(position_m)
    most = float(stiffness.max()), float(damping.max())
    inputs = np.zeros((_INPUTS, w.size))
    inputs[0], inputs[2] = _PLACE_M / model.radius_m, w
    inputs[4], inputs[5], inputs[6] = stiffness / most[0], damping / most[1], model.load_kg
    output = np.empty((3 + _STATES, w.size))
    done = Engine(_engine(model, drive, most), _PLACE_M).advance(inputs, output)
    if done < w.size:
        raise SimulationError(
            "diverged",
            "the fitted model diverges in its loop",
            "check the loop's description and the radius",
            sample=int(done),
        )
    return output[0], late(output[1], model.delay_s * drive.rate_hz)


def late(velocity: Floats, samples: float) -> Floats:
    """The velocity by so many samples, whole or not, later: a cubic spline, exact to 1e-5 at a tenth of the rate.

    Shape (samples,) or (rows, samples), finite, at least one sample; beyond the ends they continue constant. The bits
    are those of SciPy's `ndimage.shift` with its mode "nearest", and do not depend on the other rows.
    """
    if samples == 0:
        return velocity
    shifted = np.empty(velocity.shape)
    _late(np.atleast_2d(velocity), samples, np.atleast_2d(shifted))
    return shifted


def without_drift(model: Floats, measured: Floats, window: int) -> Floats:
    """The model's velocity, with its slow difference from the measured one added: two boxcars of a window each.

    A boxcar of N samples is zero at every line, and two in series, centred, leave a constant and a ramp unchanged.
    At the ends the last value is repeated.
    """
    slow, padded = measured - model, np.empty(model.size + window)
    for early in (window // 2, (window - 1) // 2):
        padded[: early + 1], padded[early + 1 : early + 1 + model.size] = slow[0], slow
        padded[early + 1 + model.size :] = slow[-1]
        mean = padded.mean()
        total = np.cumsum(padded - mean)
        slow = (total[window:] - total[:-window]) / window + mean
    return np.asarray(model + slow)


def _engine(model: MovingModel, drive: Drive, most: tuple[float, float]) -> dict[str, Any]:
    """Settings of the Engine for the model's small motion around `_PLACE_M`, however far it goes.

    `most`: the stiffness, N/m, and the damping, N s/m, that its inputs 4 and 5 give tick by tick as shares.
    """
    mechanics = Mechanics(
        inertia_kg_m2=model.inertia_kg_m2,
        pulley_inertia_kg_m2=model.inertia_kg_m2 / 4,  # part of Js with two masses
        load_kg=model.load_kg,
        radius_m=model.radius_m,
        stiffness_n_per_m=most[0],
        damping_n_s_per_m=most[1],
        nominal_position_m=_PLACE_M,
        frozen_position_m=_PLACE_M,
    )
    axis = BeltAxis(mechanics=mechanics, drive=drive, motion=Standstill(position_m=_PLACE_M))
    return engine_settings(axis) | {"position_m_min": -_ANYWHERE_M, "position_m_max": _ANYWHERE_M}


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


@dataclass(frozen=True, eq=False)
class Residual:
    """y less the model's velocity under the measured torque, without slow drift; and the cart's velocity, rad/s."""

    velocity: Floats
    cart: Floats


def residual(model: MovingModel, chunk: Chunk, settings: Settings) -> Residual:
    """The residual over a chunk; NaN where a sample is missing. Arrays of shape (samples,)."""
    lines = settings.lines
    motor, cart = by_torque(model, lines.rate_hz, chunk.u, chunk.x)
    slow = without_drift(motor, chunk.y, lines.window) - motor
    return Residual(np.where(chunk.missing, np.nan, chunk.y - motor - slow), cart / model.radius_m + slow)


class Scatter(StatefulBase):
    """A Tracker on the residual: R/U, and the noise from the scatter of R between periods, or from detection lines.

    The motion is also in the model, so the residual does not contain it. The memory continues from chunk to chunk;
    windows across a chunk's end are not used, because they would contain two models.
    """

    _stage = Stage("residual-scatter", 1)

    def __init__(self, settings: Settings) -> None:
        self._settings = replace(settings, schedule=None, spikes=(), ripple=())
        self._memory = b""

    def once(self, velocity: Floats, chunk: Chunk) -> Responses:
        """Responses R/U of this residual, without memory."""
        return Tracker(self._settings, repeating=False).process(self._block(velocity, chunk))

    def then(self, velocity: Floats, chunk: Chunk) -> tuple[Responses, bytes]:
        """Corrected responses with their sigma, and the memory for `keep`."""
        tracker, block = Tracker(self._settings, repeating=False), self._block(velocity, chunk)
        if self._memory:
            tracker.restore(self._memory)
        until = chunk.stop - self._settings.lines.window + 1 - block.start
        if until <= 0:
            return tracker.process(block), self._memory
        parts = [tracker.process(block.cut(0, until))]
        memory = tracker.snapshot()
        return Responses.join([*parts, tracker.process(block.cut(until, len(block)))]), memory

    def keep(self, memory: bytes) -> None:
        self._memory = memory

    def _block(self, velocity: Floats, chunk: Chunk) -> Block:
        """The residual from the first sample of a new window on."""
        s = self._settings
        rows = {s.output: velocity, s.input: chunk.u} | ({s.excitation: chunk.w} if s.excitation else {})
        names = [name for name in rows if name]
        begin = max(chunk.first - s.lines.window + 1 - chunk.start, 0)
        data = np.array([rows[name][begin:] for name in names])
        return Block(data, tuple(map(Channel, names)), s.lines.rate_hz, start=chunk.start + begin, gap=True)

    def _state(self) -> dict[str, Any]:
        return {"memory": self._memory}

    def _load(self, state: dict[str, Any]) -> None:
        if state["memory"]:
            Tracker(self._settings, repeating=False).restore(state["memory"])
        self._memory = state["memory"]
