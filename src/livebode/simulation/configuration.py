"""BeltAxis: everything about one simulated run, checked before it starts."""

from __future__ import annotations

from dataclasses import field
from math import ceil, inf, isnan, log2, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import SimulationError, UsageError
from livebode.dataclass import dataclass
from livebode.simulation._linear import StateSpace, linear
from livebode.simulation.axis_settings import Drive, Friction, Limits, Sensor
from livebode.simulation.closed_loop import ClosedLoop
from livebode.simulation.faults import Condition, Fault, SoftSpot, condition_at
from livebode.simulation.mechanics import Mechanics, Spans
from livebode.simulation.motion import Motion, Standstill
from livebode.simulation.values import count, nonnegative

SPOTS_MAX = 16
RUN_IN_S_MAX = 600.0
SUBSTEPS_MAX = 1000
_OF_MECHANICS = (
    "motor_inertia_kg_m2",
    "pulley_inertia_kg_m2",
    "radius_m",
    "eccentricity",
    "specific_stiffness_n",
    "pulley_distance_m",
    "damping_shape",
)
_OF_DRIVE = (
    "rate_hz",
    "velocity_ticks",
    "position_ticks",
    "delay_ticks",
    "velocity_gain_n_m_s",
    "position_gain_per_s",
    "velocity_feedforward",
    "torque_n_m_max",
)
# The product of the fastest mode (rad/s) and a step of the integration; the order-8 method then errs by 1e-10 or less.
_STEP_MAX = 0.2
_PLAY_STEPS = 64  # of a tick in which a play opens or closes
# Of the largest eigenvalue over 1; rounding alone makes the double one of an open loop this large.
_UNSTABLE = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class BeltAxis:
    """A tooth-belt axis, its drive, its motion and its faults.

    Parameters
    ----------
    mechanics, friction, drive, sensor, limits
        The machine.
    motion
        `Strokes` or `Standstill`, or anything with their two methods.
    excitation_n_m
        One period of the excitation w, N m, repeated from the first tick on; empty for none.
    faults
        Any number, all active together.
    seconds
        Length of the run; infinite by default.
    run_in_s
        Time at standstill at the motion's start, under excitation and noise, before sample 0. From rest the loop of
        Table I differs by 2 % from its periodic state in the first window, by 4e-5 after 2 s, 1e-8 after 10 s. Faults
        are those of time 0 during this time.
    seed
        Of the sensor's noise: the same seed gives the same samples.
    substeps
        Integration steps in a tick; None chooses them from the fastest mode, and shorter ones where a play opens or
        closes.

    Raises
    ------
    LivebodeError
        If the motion exceeds the limits, a rate does not divide, or the loop is unstable at an end or the middle of the
        motion's range, at a soft spot in it, or at any fault's beginning or end.

    Examples
    --------
    >>> axis = BeltAxis(motion=Standstill(position_m=0.8), seconds=10)
    >>> axis.substeps_chosen
    1
    """

    mechanics: Mechanics = field(default_factory=Mechanics)
    friction: Friction = field(default_factory=Friction)
    drive: Drive = field(default_factory=Drive)
    sensor: Sensor = field(default_factory=Sensor)
    limits: Limits = field(default_factory=Limits)
    motion: Motion = field(default_factory=Standstill)
    excitation_n_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    faults: tuple[Fault, ...] = ()
    seconds: float = inf
    run_in_s: float = 0.0
    seed: int = 0
    substeps: int | None = None

    def __post_init__(self) -> None:
        excitation = np.array(self.excitation_n_m, dtype=np.float64)
        excitation.flags.writeable = False
        object.__setattr__(self, "excitation_n_m", excitation)
        object.__setattr__(self, "faults", tuple(self.faults))
        self._check_numbers()
        low, high = self.limits.stops_m
        if low <= 0 or high >= self.mechanics.pulley_distance_m:
            raise SimulationError(
                "stroke-beyond-machine",
                f"the stroke with its overrun goes from {low:g} to {high:g} m, which is "
                f"not between the pulleys at 0 and pulley_distance_m={self.mechanics.pulley_distance_m}",
                "shorten the stroke or the overrun",
                low_m=low,
                high_m=high,
                pulley_distance_m=self.mechanics.pulley_distance_m,
            )
        self.motion.check(self.limits)
        self._check_faults()
        self._check_stability()

    def _check_numbers(self) -> None:
        if self.excitation_n_m.ndim != 1 or not np.all(np.isfinite(self.excitation_n_m)):
            raise UsageError(
                "wrong-shape",
                f"excitation_n_m has shape {self.excitation_n_m.shape} or is not finite",
                "specify one period of finite numbers, N m",
                argument="excitation_n_m",
                shape=list(self.excitation_n_m.shape),
            )
        if isnan(self.seconds) or self.seconds <= 0:
            raise UsageError(
                "out-of-range",
                f"seconds={self.seconds} is not above 0",
                "leave it out for a run without end",
                argument="seconds",
                value=self.seconds,
            )
        nonnegative(self, "run_in_s")
        if self.run_in_s > RUN_IN_S_MAX:
            raise UsageError(
                "out-of-range",
                f"run_in_s={self.run_in_s} is above {RUN_IN_S_MAX:g}",
                "specify less: the loop of Table I settles in 10 s",
                argument="run_in_s",
                value=self.run_in_s,
                high=RUN_IN_S_MAX,
            )
        count(self, "seed", 1 << 63)
        if self.substeps is not None:
            count(self, "substeps", SUBSTEPS_MAX)
            if self.substeps < 1:
                raise UsageError(
                    "out-of-range",
                    f"substeps={self.substeps} is not at least 1",
                    "leave it out to have them chosen",
                    argument="substeps",
                    value=self.substeps,
                    low=1,
                )

    def _check_faults(self) -> None:
        if len(self.spots) > SPOTS_MAX:
            raise UsageError(
                "out-of-range",
                f"there are {len(self.spots)} soft spots, more than {SPOTS_MAX}",
                "leave some out",
                argument="faults",
                value=len(self.spots),
                high=SPOTS_MAX,
            )
        condition = self.condition(self._moments_s)
        for name in ("stiffness", "damping", "load_kg"):
            if (least := float(np.min(getattr(condition, name)))) <= 0:
                raise SimulationError(
                    "parameters-impossible",
                    f"the faults together reduce {name} to {least:g}, but it must remain above 0",
                    "make them smaller",
                    parameter=name,
                    value=least,
                )

    def _check_stability(self) -> None:
        for time_s in self._moments_s.tolist():
            for position_m in self._places_m:
                radius = self.closed_loop(position_m, time_s).spectral_radius
                if radius > 1 + _UNSTABLE:
                    raise SimulationError(
                        "unstable",
                        f"the closed loop is unstable with the cart at {position_m:g} m, {time_s:g} "
                        f"s: an eigenvalue has size {radius:.6f}, above 1",
                        "lower the gains or the delay",
                        position_m=position_m,
                        time_s=time_s,
                        spectral_radius=radius,
                    )

    @property
    def _moments_s(self) -> Floats:
        return np.array(sorted({0.0, *(moment for fault in self.faults for moment in fault.moments_s)}))

    @property
    def _places_m(self) -> list[float]:
        """Ends and middle of the motion, and the soft spots in its range."""
        position, _ = self.motion.cycle(self.drive.rate_hz)
        low, high = float(position.min()), float(position.max())
        inside = {spot.position_m for spot in self.spots if low <= spot.position_m <= high}
        return sorted({low, (low + high) / 2, high} | inside)

    @property
    def spots(self) -> tuple[SoftSpot, ...]:
        return tuple(fault for fault in self.faults if isinstance(fault, SoftSpot))

    @property
    def samples(self) -> int | None:
        """Ticks of the run; None without end."""
        return None if self.seconds == inf else round(self.seconds * self.drive.rate_hz)

    @property
    def substeps_chosen(self) -> int:
        """Integration steps in a tick."""
        if self.substeps is not None:
            return self.substeps
        fastest = max(
            float(np.max(np.abs(np.linalg.eigvals(self.linear(x, t).a))))
            for x in (self._places_m[0] - self.limits.overrun_m, self._places_m[-1] + self.limits.overrun_m)
            for t in self._moments_s.tolist()
        )
        smooth = ceil(fastest / self.drive.rate_hz / _STEP_MAX)
        # A sign smoothed over less speed changes within less time (docs/reference/axis.md: 5e-8 of a stroke at worst).
        dry = 2 * ceil(sqrt(0.005 / self.friction.smoothing_m_per_s)) if self.friction.dry else 1
        return max(smooth, dry, 1)

    @property
    def halvings(self) -> int:
        """How often a step is halved in which a play opens or closes."""
        backlash = bool(np.any(self.condition(self._moments_s).gap_m))
        return ceil(log2(max(1, _PLAY_STEPS / self.substeps_chosen))) if backlash and self.substeps is None else 0

    def condition(self, time_s: Floats) -> Condition:
        """The machine's parameters at these times, without the soft spots."""
        return condition_at(self.faults, time_s, self.mechanics.load_kg)

    def weakening(self, position_m: Floats) -> Floats:
        """Factor of the soft spots on the stiffness with the cart at these positions."""
        cart_m = self.mechanics.effective(position_m)
        return np.asarray(np.prod([spot.factor(cart_m) for spot in self.spots], axis=0) * np.ones(np.shape(cart_m)))

    def spans(self, position_m: float, time_s: float = 0.0) -> Spans:
        """The belt with the cart at `position_m`, under the faults of that time."""
        condition = self.condition(np.array([time_s]))
        factor = float(condition.stiffness[0]) * float(self.weakening(np.array(position_m)))
        return Spans.of(self.mechanics, position_m, factor, float(condition.damping[0]))

    def linear(self, position_m: float, time_s: float = 0.0) -> StateSpace:
        """The exact linearisation around rest at a cart position, torque to motor velocity, continuous."""
        load_kg = float(self.condition(np.array([time_s])).load_kg[0])
        return linear(self.mechanics, self.friction, self.spans(position_m, time_s), load_kg)

    def closed_loop(self, position_m: float, time_s: float = 0.0) -> ClosedLoop:
        """Linearisation in the drive's loop: Y/W, U/W."""
        return ClosedLoop(self.linear(position_m, time_s), self.drive, self.sensor)


def controller_settings(drive: Drive, sensor: Sensor) -> dict[str, Any]:
    """Parameters of sensor and control, for the C code and the twin."""
    return {name: getattr(drive, name) for name in _OF_DRIVE} | {
        "integral_step": 1.0 / (drive.velocity_rate_hz * drive.integral_time_s),
        "encoder_step_rad": sensor.encoder_step_rad,
        "encoder_eccentricity_rad": sensor.encoder_eccentricity_rad,
        "velocity_differenced": int(sensor.velocity_differenced),
    }


def engine_settings(axis: BeltAxis) -> dict[str, Any]:
    """Parameters of the C simulation and its twin."""
    m, f, d = axis.mechanics, axis.friction, axis.drive
    same = {name: getattr(f, name) for name in f.__dataclass_fields__}
    same |= {name: getattr(m, name) for name in _OF_MECHANICS}
    return (
        controller_settings(d, axis.sensor)
        | same
        | {
            "torque_ripple_n_m": d.torque_ripple_n_m,
            "torque_ripple_per_turn": d.torque_ripple_per_turn,
            "states": 2 * m.masses,
            "frozen": int(m.frozen_position_m is not None),
            "frozen_position_m": m.frozen_position_m or 0.0,
            "spots": [(spot.position_m, spot.width_m, spot.loss) for spot in axis.spots],
            "substeps": axis.substeps_chosen,
            "halvings": axis.halvings,
            "position_m_min": axis.limits.stops_m[0],
            "position_m_max": axis.limits.stops_m[1],
        }
    )
