"""Friction, drive, sensor and limits: plain frozen settings; a disabled effect is zero or infinite."""

from __future__ import annotations

from math import inf, isnan, pi
from typing import Annotated

from annotated_types import Ge, Le

from livebode.core import PID, Cascade, Loop, UsageError
from livebode.dataclass import dataclass
from livebode.simulation.values import NonNegative, Positive, count, nonnegative, positive

DELAY_TICKS_MAX = 64
_COUNTS_MAX = 1 << 32  # in double precision, positions in counts are exact over 2²¹ turns


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Friction of the motor's shaft, N m, and of the cart on its guide, N; all off by default.

    viscous·v + (coulomb + stribeck/(1 + (v/vs)²))·v/√(v² + w²): v is the speed at the belt (of the shaft for the
    motor's viscous part), vs `stribeck_speed_m_per_s`, w `smoothing_m_per_s`. The Stribeck term is that of Hess and
    Soom (J. Tribology 112, 1990); the smooth sign, and so the absence of true sticking, keeps the equations analytic.

    Parameters
    ----------
    motor_coulomb_n_m
        Coulomb friction of the motor's shaft, N m.
    motor_viscous_n_m_s
        Viscous friction of the motor's shaft, N m s.
    motor_stribeck_n_m
        Additional friction of the motor's shaft near standstill, N m.
    load_coulomb_n
        Coulomb friction of the cart, N.
    load_viscous_n_s_per_m
        Viscous friction of the cart, N s/m.
    load_stribeck_n
        Additional friction of the cart near standstill, N.
    stribeck_speed_m_per_s
        Speed at which half of the Stribeck term is left, m/s.
    smoothing_m_per_s
        Speed over which the sign of the friction is smoothed, m/s.
    """

    motor_coulomb_n_m: NonNegative = 0.0
    motor_viscous_n_m_s: NonNegative = 0.0
    motor_stribeck_n_m: NonNegative = 0.0
    load_coulomb_n: NonNegative = 0.0
    load_viscous_n_s_per_m: NonNegative = 0.0
    load_stribeck_n: NonNegative = 0.0
    stribeck_speed_m_per_s: Positive = 0.05
    smoothing_m_per_s: Positive = 0.01

    def __post_init__(self) -> None:
        nonnegative(self, *(name for name in self.__dataclass_fields__ if name.startswith(("motor", "load"))))
        positive(self, "stribeck_speed_m_per_s", "smoothing_m_per_s")

    @property
    def dry(self) -> bool:
        """Whether any other friction than the viscous one is on."""
        return any((self.motor_coulomb_n_m, self.motor_stribeck_n_m, self.load_coulomb_n, self.load_stribeck_n))


@dataclass(frozen=True, kw_only=True)
class Drive:
    """The cascade of Nevaranta 2016, Fig. 7, with its rates and holds, and the motor's torque.

    A tick reads the angle and the velocity y, updates the position and the velocity loop if due, adds the
    excitation w and applies the torque u until the next tick; y is logged as read, u and w as applied.

    Parameters
    ----------
    rate_hz
        Ticks per second, Hz: the rate of the record.
    velocity_rate_hz
        Rate of the velocity controller, Hz; divides rate_hz. Its output is held in between.
    position_rate_hz
        Rate of the position controller, Hz; divides velocity_rate_hz. Its output is held in between.
    velocity_gain_n_m_s
        Gain Kvc of the PI velocity controller, N m s.
    integral_time_s
        Integral time Ti of the PI velocity controller, s; backward integrator.
    position_gain_per_s
        Gain Kpc of the P position controller, 1/s.
    velocity_feedforward
        Share of the reference velocity that the position controller adds.
    delay_ticks
        Ticks between reading and the velocity controller's output acting; the excitation is added after it.
    torque_n_m_max
        The torque u is limited to ± this value, N m, and the integrator stops meanwhile. Default: no limit.
    torque_ripple_n_m
        Amplitude of a torque ripple that is added after the logged u, N m.
    torque_ripple_per_turn
        Periods of the torque ripple per turn of the motor.
    torque_noise_n_m
        Standard deviation of a white Gaussian torque that is added after the logged u, N m; constant over a tick.
    """

    rate_hz: Positive = 4000.0
    velocity_rate_hz: Positive = 4000.0
    position_rate_hz: Positive = 2000.0
    velocity_gain_n_m_s: NonNegative = 0.2308
    integral_time_s: Positive = 0.2
    position_gain_per_s: NonNegative = 1.0
    velocity_feedforward: NonNegative = 1.0
    delay_ticks: Annotated[int, Ge(0), Le(DELAY_TICKS_MAX)] = 0
    torque_n_m_max: Positive = inf
    torque_ripple_n_m: NonNegative = 0.0
    torque_ripple_per_turn: Positive = 24.0
    torque_noise_n_m: NonNegative = 0.0

    def __post_init__(self) -> None:
        positive(self, "rate_hz", "velocity_rate_hz", "position_rate_hz", "integral_time_s", "torque_ripple_per_turn")
        nonnegative(self, "velocity_gain_n_m_s", "position_gain_per_s", "velocity_feedforward", "torque_ripple_n_m")
        nonnegative(self, "torque_noise_n_m")
        count(self, "delay_ticks", DELAY_TICKS_MAX)
        if isnan(self.torque_n_m_max) or self.torque_n_m_max <= 0:
            raise UsageError(
                "out-of-range",
                f"torque_n_m_max={self.torque_n_m_max} is not above 0",
                "leave it out for no limit",
                argument="torque_n_m_max",
                value=self.torque_n_m_max,
            )
        _divides("velocity_rate_hz", self.velocity_rate_hz, "rate_hz", self.rate_hz)
        _divides("position_rate_hz", self.position_rate_hz, "velocity_rate_hz", self.velocity_rate_hz)

    @property
    def velocity_ticks(self) -> int:
        """Ticks during which one output of the velocity controller is held."""
        return round(self.rate_hz / self.velocity_rate_hz)

    @property
    def position_ticks(self) -> int:
        """Ticks during which one output of the position controller is held."""
        return round(self.rate_hz / self.position_rate_hz)

    def loop(self, *, velocity_differenced: bool = False) -> Loop:
        """The description of this drive for an estimator; whether its velocity is a difference, the sensor decides.

        >>> Drive().loop().feedback_at(100.0).round(4)
        np.complex128(0.2309-0.0022j)
        """
        velocity = PID(
            gain=self.velocity_gain_n_m_s,
            integral_time_s=self.integral_time_s,
            rate_hz=self.velocity_rate_hz,
            rate_divider=self.velocity_ticks,
            delay_ticks=self.delay_ticks,
        )
        ratio = round(self.velocity_rate_hz / self.position_rate_hz)
        position = PID(gain=self.position_gain_per_s, rate_hz=self.position_rate_hz, rate_divider=ratio)
        return Loop(Cascade(velocity, position, velocity_differenced))


def _divides(slow_name: str, slow_hz: float, fast_name: str, fast_hz: float) -> None:
    ratio = round(fast_hz / slow_hz)
    if ratio < 1 or abs(fast_hz / slow_hz - ratio) > 1e-9 * ratio:
        near = ", ".join(f"{fast_hz / n:g}" for n in sorted({max(ratio, 1), ratio + 1}))
        raise UsageError(
            "conflict",
            f"{slow_name}={slow_hz:g} does not divide {fast_name}={fast_hz:g}",
            f"choose for example {near}",
            argument=slow_name,
            value=slow_hz,
            rate_hz=fast_hz,
        )


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Sensor of angle and velocity; exact by default.

    Parameters
    ----------
    noise_rad_per_s
        Standard deviation of white Gaussian noise on the read velocity, rad/s.
    encoder_counts_per_turn
        Counts of the encoder per turn: the angle is rounded to these, and the velocity contains the rounding's
        differences times the rate. 0: exact.
    encoder_eccentricity_rad
        Amplitude of the position error of an eccentric encoder, once a turn: it reads φ + this·sin φ, rad.
    velocity_differenced
        The velocity is the difference of the last two angles times the rate, with its lag of half a tick; else the
        velocity at the tick itself.
    """

    noise_rad_per_s: NonNegative = 0.0
    encoder_counts_per_turn: Annotated[int, Ge(0), Le(_COUNTS_MAX)] = 0
    encoder_eccentricity_rad: NonNegative = 0.0
    velocity_differenced: bool = False

    def __post_init__(self) -> None:
        nonnegative(self, "noise_rad_per_s", "encoder_eccentricity_rad")
        count(self, "encoder_counts_per_turn", _COUNTS_MAX)

    @property
    def encoder_step_rad(self) -> float:
        return 2 * pi / self.encoder_counts_per_turn if self.encoder_counts_per_turn else 0.0


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of the machine: a stroke of 1.6 m between the pulleys, 3000 rpm and 14.5 N m of Nevaranta's motor.

    The reference is always within them; the cart itself may overrun the stroke by `overrun_m` before the run stops.

    Parameters
    ----------
    position_m_min
        Lowest position of the cart, m.
    position_m_max
        Highest position of the cart, m.
    overrun_m
        Distance by which the cart may leave the stroke before the run stops, m.
    speed_m_per_s_max
        Largest speed of the reference, m/s.
    acceleration_m_per_s2_max
        Largest acceleration of the reference, m/s².
    """

    position_m_min: Positive = 0.2
    position_m_max: Positive = 1.8
    overrun_m: NonNegative = 0.05
    speed_m_per_s_max: Positive = 5.9
    acceleration_m_per_s2_max: Positive = 50.0

    def __post_init__(self) -> None:
        positive(self, "position_m_min", "position_m_max", "speed_m_per_s_max", "acceleration_m_per_s2_max")
        nonnegative(self, "overrun_m")
        if not self.position_m_min < self.position_m_max:
            raise UsageError(
                "out-of-range",
                f"position_m_min={self.position_m_min} is not below position_m_max={self.position_m_max}",
                "swap them",
                argument="position_m_min",
                value=self.position_m_min,
                position_m_max=self.position_m_max,
            )

    @property
    def stops_m(self) -> tuple[float, float]:
        """Positions at which the run stops."""
        return self.position_m_min - self.overrun_m, self.position_m_max + self.overrun_m
