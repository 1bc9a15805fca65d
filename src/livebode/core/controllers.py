"""Controllers as they run in a drive: each with its own rate, hold, delay and integrator rule.

docs/how-to/loop.md lists the effect of a wrong description; one forgotten tick of delay is 10 % of the plant's
response.
"""

from __future__ import annotations

from math import inf
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core.errors import UsageError
from livebode.core.model import Algebra
from livebode.dataclass import dataclass

Rule = Literal["backward", "forward", "trapezoidal", "continuous"]
Hold = Literal["zero-order", "none"]


def integral(frequency_hz: ArrayLike, rate_hz: float, rule: Rule) -> NDArray[np.complex128]:
    """Response of an integrator that runs at `rate_hz`, in seconds.

    backward T·z/(z − 1), forward T/(z − 1), trapezoidal T/2·(z + 1)/(z − 1), continuous 1/(jω); T = 1/rate.

    >>> abs(integral(10.0, 4000.0, "backward") * 2j * 3.141592653589793 * 10.0).round(4)
    np.float64(1.0)
    """
    s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
    if rule == "continuous":
        return np.asarray(1 / s)
    z = np.exp(s / rate_hz)
    numerator = {"backward": z, "forward": 1.0, "trapezoidal": (z + 1) / 2}[rule]
    return np.asarray(numerator / ((z - 1) * rate_hz))


@dataclass(frozen=True, kw_only=True)
class DriveTiming(Algebra):
    """The parameters that all controllers in a drive have: a rate, a hold towards the faster inner loop, and a delay.

    Parameters
    ----------
    rate_hz
        Computations per second.
    rate_divider
        Ticks of the recorded loop during which one output is held: the recorded rate over `rate_hz`. A
        controller at half the rate of the recording has 2.
    hold
        "zero-order" (the output is held) or "none" (for a Model of a filter that interpolates by itself).
    delay_ticks
        Whole ticks of the recorded loop between reading its input and acting, beyond the hold.
    lowpass_s
        Time constant Tl of a low-pass of first order on its output, 1/(1 + Tl·D) at `rate_hz`; 0: none.
    """

    rate_hz: float
    rate_divider: int = 1
    hold: Hold = "zero-order"
    delay_ticks: int = 0
    lowpass_s: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.rate_hz) and self.rate_hz > 0):
            raise UsageError(
                "out-of-range",
                f"rate_hz={self.rate_hz} of a controller is not a positive number",
                "specify how often it is computed per second",
                argument="rate_hz",
                value=self.rate_hz,
            )
        if self.rate_divider < 1 or self.delay_ticks < 0:
            name, least = ("rate_divider", 1) if self.rate_divider < 1 else ("delay_ticks", 0)
            value = getattr(self, name)
            raise UsageError(
                "out-of-range",
                f"{name}={value} of a controller is less than {least}",
                f"specify {least} or more",
                argument=name,
                value=value,
            )
        if not 0 <= self.lowpass_s < inf:
            raise UsageError(
                "out-of-range",
                f"lowpass_s={self.lowpass_s} of a controller is not a time constant",
                "specify 0 or more seconds",
                argument="lowpass_s",
                value=self.lowpass_s,
            )
        if self.hold not in ("zero-order", "none"):
            raise UsageError(
                "not-one-of",
                f"hold={self.hold!r} is not supported",
                "choose 'zero-order' or 'none'",
                argument="hold",
                value=self.hold,
                allowed=["zero-order", "none"],
            )

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        f = np.asarray(frequency_hz, dtype=np.float64)
        if self.hold == "none":
            return self.before_hold(f)
        tick = self._tick(f)
        return np.asarray(self.before_hold(f) * np.mean([tick**i for i in range(self.rate_divider)], axis=0))

    def before_hold(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Law, low-pass and delay without the hold: what acts on samples that are held already."""
        law = self.law(frequency_hz)
        if self.lowpass_s:
            law = law / (1 + self.lowpass_s / integral(frequency_hz, self.rate_hz, "backward"))
        return np.asarray(law * self._tick(frequency_hz) ** self.delay_ticks, dtype=np.complex128)

    def _tick(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Delay of one tick of the recorded loop."""
        return np.asarray(np.exp(-2j * np.pi * frequency_hz / (self.rate_hz * self.rate_divider)))

    def law(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        """The control law alone, as computed at `rate_hz`, without hold and delay."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class PID(DriveTiming):
    """gain·(1 + I/Ti + Td·D/(1 + Tf·D)), the ideal form; P and PI are the same with fewer terms.

    I is the integrator by `integrator`, D the backward difference (1 − z⁻¹)·rate. Without `derivative_time_s` and
    with an infinite `integral_time_s` (the default) it is a plain gain.

    Raises
    ------
    UsageError
        If the integral time is not positive or the integrator rule is not known.

    Examples
    --------
    >>> velocity = PID(gain=0.2308, integral_time_s=0.2, rate_hz=4000)
    >>> abs(velocity.response(100.0)).round(4)
    np.float64(0.231)
    """

    gain: float
    integral_time_s: float = inf
    derivative_time_s: float = 0.0
    derivative_filter_s: float = 0.0
    integrator: Rule = "backward"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.integral_time_s > 0:
            raise UsageError(
                "out-of-range",
                f"integral_time_s={self.integral_time_s} is not positive",
                "leave it out for a P controller",
                argument="integral_time_s",
                value=self.integral_time_s,
            )
        if self.integrator not in ("backward", "forward", "trapezoidal", "continuous"):
            raise UsageError(
                "not-one-of",
                f"integrator={self.integrator!r} is not supported",
                "choose backward, forward, trapezoidal or continuous",
                argument="integrator",
                value=self.integrator,
                allowed=["backward", "forward", "trapezoidal", "continuous"],
            )

    def law(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        law = np.ones(frequency_hz.shape, dtype=np.complex128)
        if np.isfinite(self.integral_time_s):
            law += integral(frequency_hz, self.rate_hz, self.integrator) / self.integral_time_s
        if self.derivative_time_s:
            slope = 1 / integral(frequency_hz, self.rate_hz, "backward")
            law += self.derivative_time_s * slope / (1 + self.derivative_filter_s * slope)
        return self.gain * law


@dataclass(frozen=True, kw_only=True)
class PositionPD(DriveTiming):
    """Gains on position and on differenced velocity, kv·(kp + D), for a loop that measures position.

    D is the backward difference of the mean of two neighbouring positions when `smoothed` (as in the EMPS
    benchmark: dq[n] = rate·diff((q[n] + q[n−1])/2)), of the positions themselves otherwise.

    Examples
    --------
    >>> controller = PositionPD(position_gain=160.0, velocity_gain=243.0, smoothed=True, rate_hz=1000)
    >>> abs(controller.response([1.0, 10.0])).round()
    array([38920., 42649.])
    """

    position_gain: float
    velocity_gain: float
    smoothed: bool = False

    def law(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        before = np.exp(-2j * np.pi * frequency_hz / self.rate_hz)
        slope = self.rate_hz * (1 - before) * ((1 + before) / 2 if self.smoothed else 1)
        return np.asarray(self.velocity_gain * (self.position_gain + slope))


@dataclass(frozen=True)
class Cascade(Algebra):
    """P position loop around a velocity loop, as seen from the measured velocity: Cvel·(1 + Cpos·∫).

    Nevaranta 2016, eq. (16), for sampled loops: the position is the trapezoidal integral of the sampled velocity
    at the velocity controller's rate, exact to about 2e-6 where the loop samples both. Velocity feedforward acts on
    the reference only and so does not appear. Where the velocity controller is slower than the recording, it reads a
    reference that changes only at its own ticks, so that its hold does not delay the position's part again.

    Parameters
    ----------
    velocity, position
        The controllers.
    velocity_differenced
        The velocity is the difference of the last two positions times the rate, so that the position is its sum, the
        backward integral.

    Examples
    --------
    >>> loop = Cascade(
    ...     velocity=PID(gain=0.2308, integral_time_s=0.2, rate_hz=4000),
    ...     position=PID(gain=1.0, rate_hz=2000, rate_divider=2),
    ... )
    >>> loop.response([20.0, 140.0]).shape
    (2,)
    """

    velocity: PID
    position: DriveTiming
    velocity_differenced: bool = False

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        f = np.asarray(frequency_hz, dtype=np.float64)
        return np.asarray(self.velocity.response(f) * (1 + self.outer(f)))

    def outer(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Position controller and integral, in units of the velocity controller."""
        inner, outer = self.velocity, self.position
        rule: Rule = "backward" if self.velocity_differenced else "trapezoidal"
        tick_hz = inner.rate_hz * inner.rate_divider
        if self.in_step:
            turn = np.exp(-2j * np.pi * frequency_hz / inner.rate_hz)
            held = np.mean([turn**i for i in range(outer.rate_divider // inner.rate_divider)], axis=0)
            position = outer.before_hold(frequency_hz) * held
        else:
            position = outer.response(frequency_hz)
        return np.asarray(position * integral(frequency_hz, tick_hz, rule))

    @property
    def in_step(self) -> bool:
        """Whether the position controller changes its output only at ticks of the velocity controller."""
        return self.position.hold == "zero-order" and self.position.rate_divider % self.velocity.rate_divider == 0
