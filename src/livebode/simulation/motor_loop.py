"""A mechanism with several motors, each under its own velocity controller."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from livebode.arrays import Floats
from livebode.core import PID, Block, Channel, UsageError
from livebode.dataclass import dataclass
from livebode.simulation.mechanism import LinearMechanism

_TOGETHER = 32  # ticks that one matrix product advances
_AT_REST = 1e-7  # distance from 1 of an eigenvalue that is a position; a double one is off by 1e-8


@dataclass(frozen=True, kw_only=True)
class MotorLoop(ABC):
    """A PI velocity controller for each motor: torque = w − gain·(1 + ∫/Ti)·velocity.

    Every tick the drives read the speeds of their motors, compute, and hold the torque until the next tick. Signals are
    logged as a Loop expects: speeds before and torques after the update.

    Parameters
    ----------
    rate_hz
        Of the controllers and of the recording.
    gain_n_m_s, integral_time_s
        One for all motors, or one for each.
    """

    rate_hz: float = 4000.0
    gain_n_m_s: float | Sequence[float] = 0.3
    integral_time_s: float | Sequence[float] = 0.05

    def __post_init__(self) -> None:
        for name in ("rate_hz", "gain_n_m_s", "integral_time_s"):
            given, low = np.asarray(getattr(self, name), dtype=np.float64), name != "gain_n_m_s"
            if given.shape not in ((), (self.mechanism.motors,) if name != "rate_hz" else ()):
                raise UsageError(
                    "wrong-shape",
                    f"{name} has {given.size} values for {self.mechanism.motors} motors",
                    "give one, or one for each motor",
                    argument=name,
                    shape=list(given.shape),
                )
            if not (np.all(np.isfinite(given)) and np.all(given > 0 if low else given >= 0)):
                raise UsageError(
                    "out-of-range",
                    f"{name}={getattr(self, name)} is not finite and {'above' if low else 'at least'} 0",
                    "correct it",
                    argument=name,
                    value=getattr(self, name),
                )

    @property
    @abstractmethod
    def mechanism(self) -> LinearMechanism:
        """What the motors drive."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels of `simulate`: w and u of each motor, then the outputs."""
        numbers = range(1, self.mechanism.motors + 1)
        torques = [Channel(f"{role}{i}", "N m") for role in "wu" for i in numbers]
        return (*torques, *(Channel(name, unit) for name, unit in self.mechanism.outputs))

    @property
    def controllers(self) -> tuple[PID, ...]:
        """One for each motor."""
        gains, times = self._gains
        return tuple(
            PID(gain=float(gain), integral_time_s=float(time), rate_hz=self.rate_hz) for gain, time in zip(gains, times)
        )

    @property
    def matrices(self) -> tuple[Floats, Floats]:
        """Φ and Γ of z(n+1) = Φ·z + Γ·(w, disturbance, noise) with z = (x, integrals).

        The disturbance is a torque beside u, the noise is on the outputs.
        """
        a, b, c = self.mechanism.sampled(self.rate_hz)
        motors, outputs = b.shape[1], len(c)
        gain, step = self._steps
        # The integral after the update is that before it plus step·speed.
        control = -gain @ np.hstack([(np.eye(motors) + step) @ c[:motors], np.eye(motors)])
        kept = np.hstack([step @ c[:motors], np.eye(motors)])
        state = np.vstack([np.hstack([a, np.zeros((len(a), motors))]) + b @ control, kept])
        entry = np.zeros((len(state), 2 * motors + outputs))
        entry[: len(a), :motors] = entry[: len(a), motors : 2 * motors] = b
        entry[: len(a), 2 * motors : 3 * motors] = -b @ gain @ (np.eye(motors) + step)
        entry[len(a) :, 2 * motors : 3 * motors] = step
        return state, entry

    @property
    def decay(self) -> float:
        """Size of the slowest eigenvalue that decays: transients shrink by it each tick; below 1 in a stable loop.

        Eigenvalues of 1 are positions where the mechanism remains when it comes to rest: constants that no line
        contains.
        """
        values = np.linalg.eigvals(self.matrices[0])
        return float(np.abs(values[np.abs(values - 1) > _AT_REST]).max(initial=0.0))

    def settle_periods(self, window: int, remaining: float = 1e-9) -> int:
        """Whole periods after which this share of a transient remains: the `settle` of an experiment."""
        return int(np.ceil(np.log(remaining) / (window * np.log(self.decay))))

    def simulate(self, excitation: Floats, disturbance: Floats | None = None, noise: Floats | None = None) -> Block:
        """The recording of a simulation from rest.

        Parameters
        ----------
        excitation, disturbance
            Torques added to those of the controllers, N m, and beside them, shape (motors, samples).
        noise
            On the outputs as the drives read and log them, shape (outputs, samples).
        """
        return Block(self.signals(self.inputs(excitation, disturbance, noise)), self.channels, self.rate_hz)

    def signals(self, inputs: Floats) -> Floats:
        """w, u and outputs of inputs (w, disturbance, noise), from rest.

        Both have the shape (channels, samples) or, of several runs, (channels, samples, runs).
        """
        return self.continued(inputs)[0]

    def continued(self, inputs: Floats, state: Floats | None = None) -> tuple[Floats, Floats]:
        """Signals from a state, shape (states, runs), and the state after the last sample; None: from rest."""
        motors = self.mechanism.motors
        flat = inputs.reshape(*inputs.shape[:2], -1)
        begin = np.zeros((len(self.matrices[0]), flat.shape[2])) if state is None else state
        seen, end = self._observed(flat, begin, self._speeds)
        outputs, integrals = seen[:-motors] + flat[2 * motors :], seen[-motors:]
        gain, step = self._steps
        fed = np.tensordot(np.eye(motors) + step, outputs[:motors], 1) + integrals
        torque = flat[:motors] - np.tensordot(gain, fed, 1)
        return np.concatenate([flat[:motors], torque, outputs]).reshape(inputs.shape), end

    def travels(self, inputs: Floats) -> Floats:
        """The outputs integrated over time, of `inputs` as of `signals`, shape (outputs, samples, …)."""
        flat = inputs.reshape(*inputs.shape[:2], -1)
        rows = np.zeros((len(self.mechanism.output_map), len(self.matrices[0])))
        rows[:, : self.mechanism.output_map.shape[1]] = self.mechanism.output_map
        seen, _ = self._observed(flat, np.zeros((len(self.matrices[0]), flat.shape[2])), rows)
        return seen.reshape(len(rows), *inputs.shape[1:])

    @property
    def _gains(self) -> tuple[Floats, Floats]:
        motors = self.mechanism.motors
        return np.broadcast_to(self.gain_n_m_s, (motors,)), np.broadcast_to(self.integral_time_s, (motors,))

    @property
    def _steps(self) -> tuple[Floats, Floats]:
        """Gains, and what a tick adds to the integrals, as diagonal matrices."""
        gains, times = self._gains
        return np.diag(gains), np.diag(1 / (self.rate_hz * times))

    @property
    def _speeds(self) -> Floats:
        """Rows of z that `signals` needs: the outputs and the integrals."""
        c, motors = self.mechanism.state_space[2], self.mechanism.motors
        rows = np.zeros((len(c) + motors, c.shape[1] + motors))
        rows[: len(c), : c.shape[1]] = c
        rows[len(c) :, c.shape[1] :] = np.eye(motors)
        return rows

    def inputs(self, excitation: Floats, disturbance: Floats | None = None, noise: Floats | None = None) -> Floats:
        """Inputs of `signals`, shape (channels, samples)."""
        motors = self.mechanism.motors
        inputs = np.zeros((2 * motors + len(self.mechanism.outputs), excitation.shape[1]))
        inputs[:motors] = excitation
        for rows, given in ((slice(motors, 2 * motors), disturbance), (slice(2 * motors, None), noise)):
            inputs[rows] = 0.0 if given is None else given
        return inputs

    def _observed(self, inputs: Floats, state: Floats, rows: Floats) -> tuple[Floats, Floats]:
        """rows·z before each tick, shape (rows, samples, runs), and z after the last one, from z = `state`."""
        forward, entry = self.matrices
        samples = inputs.shape[1]
        whole = samples - samples % _TOGETHER
        parts = []
        for span, ticks in ((slice(0, whole), _TOGETHER), (slice(whole, samples), samples - whole)):
            if inputs[:, span].shape[1]:
                seen, state = _advanced(inputs[:, span], state, rows, forward, entry, ticks)
                parts.append(seen)
        return np.concatenate(parts, axis=1) if parts else np.zeros((len(rows), *inputs.shape[1:])), state


def _advanced(
    inputs: Floats, state: Floats, rows: Floats, forward: Floats, entry: Floats, ticks: int
) -> tuple[Floats, Floats]:
    """Outputs and state in steps of some ticks, by the powers of Φ: a tick alone costs a call of NumPy."""
    powers = [np.eye(len(forward))]
    for _ in range(ticks):
        powers.append(forward @ powers[-1])
    count, channels, runs = inputs.shape[1] // ticks, len(inputs), inputs.shape[2]
    pushes = inputs.reshape(channels, count, ticks, runs).transpose(1, 2, 0, 3).reshape(count, ticks * channels, runs)
    free = np.vstack([rows @ power for power in powers[:-1]])
    forced = np.zeros((ticks, len(rows), ticks, channels))
    for n in range(ticks):
        for earlier in range(n):
            forced[n, :, earlier] = rows @ powers[n - 1 - earlier] @ entry
    arriving = np.hstack([powers[ticks - 1 - n] @ entry for n in range(ticks)]) @ pushes
    states = np.empty((count, *state.shape))
    for number in range(count):
        states[number] = state
        state = powers[ticks] @ state + arriving[number]
    seen = free @ states + forced.reshape(ticks * len(rows), ticks * channels) @ pushes
    return seen.reshape(count * ticks, len(rows), runs).transpose(1, 0, 2), state
