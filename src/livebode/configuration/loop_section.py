"""[loop]: the controllers of the loop, and what they form."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Annotated, Literal

from livebode import core
from livebode.configuration.section import ConfigurationSection, Positive
from livebode.core import CHANNELS_MAX, ConfigError, Field, UsageError, counted

if TYPE_CHECKING:
    from livebode.core import Loop, Model

SAME_RATE = 1e-6
Ticks = Annotated[int, Field(ge=0)]


class _ControllerSection(ConfigurationSection):
    """What all controllers have.

    Parameters
    ----------
    rate_hz
        Computations of the controller per second, in Hz.
    rate_divider
        Samples of the recording for which one output is held: the sampling rate divided by rate_hz.
    hold
        "zero-order": the output is held between computations. "none": the controller interpolates.
    delay_ticks
        Delay between reading the input and acting, in samples of the recording, in addition to the hold.
    lowpass_s
        Time constant in seconds of a low-pass of first order on the controller's output; 0: no filter.
    """

    rate_hz: Positive
    rate_divider: Annotated[int, Field(ge=1)] = 1
    hold: Literal["zero-order", "none"] = "zero-order"
    delay_ticks: Ticks = 0
    lowpass_s: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0


class PIDSection(_ControllerSection):
    """A controller gain·(1 + I/Ti + Td·D/(1 + Tf·D)).

    Parameters
    ----------
    gain
        Proportional gain: of [loop.velocity] in SI units of the input and the velocity, such as N m s/rad, to which a
        source's units are converted; of [loop.position] in 1/s.
    integral_time_s
        Integral time Ti in seconds. Default: no integrator.
    derivative_time_s
        Derivative time Td in seconds; 0: no derivative.
    derivative_filter_s
        Time constant Tf of the derivative's filter in seconds; 0: no filter.
    integrator
        Integration rule.
    """

    gain: float
    integral_time_s: Annotated[float, Field(gt=0)] = inf
    derivative_time_s: Annotated[float, Field(ge=0)] = 0.0
    derivative_filter_s: Annotated[float, Field(ge=0)] = 0.0
    integrator: Literal["backward", "forward", "trapezoidal", "continuous"] = "backward"


class PositionPDSection(_ControllerSection):
    """[loop.position_pd]: a PD controller kv·(kp + D) of the position, instead of [loop.velocity] and [loop.position].

    Parameters
    ----------
    position_gain
        Position gain kp in 1/s.
    velocity_gain
        Velocity gain kv, in SI units of the input and the velocity, such as N m s/rad.
    smoothed
        D is the difference of the means of two neighbouring positions.
    """

    position_gain: float
    velocity_gain: float
    smoothed: bool = False


class ControllerSection(ConfigurationSection):
    """[[loop.controllers]]: the controller from one output to one input of a matrix.

    Parameters
    ----------
    output
        Channel of signals.output that the controller reads.
    input
        Channel of signals.input, or with "indirect" of signals.excitation, on whose place it acts.
    velocity, position, velocity_differenced, position_pd
        As in [loop].
    """

    output: str
    input: str
    velocity: PIDSection | None = None
    position: PIDSection | None = None
    velocity_differenced: bool = False
    position_pd: PositionPDSection | None = None

    def build(self, rate_hz: float) -> Model | None:
        """The controller, recorded at `rate_hz`; ConfigError if its parts do not form one."""
        parts = ("velocity", "position", "velocity_differenced", "position_pd")
        return LoopSection(**{name: getattr(self, name) for name in parts}).build(rate_hz).feedback


class LoopSection(ConfigurationSection):
    """[loop]: the controllers, the injection point of the excitation, and the times at which signals are logged.

    Parameters
    ----------
    excitation_at
        Injection point: where the excitation is added.
    entry_gain
        Injection gain: factor on the excitation at the injection point.
    input_logged
        The input is logged before or after the controller's update.
    excitation_logged
        The excitation is logged before or after the controller's update.
    output_logged
        The output is logged before or after the controller's update.
    velocity
        The velocity controller. It belongs to an output that is a velocity.
    position
        The position controller around the velocity controller.
    velocity_differenced
        The velocity is the difference of the last two positions that the position controller reads.
    position_pd
        The whole controller of an output that is a position.
    controllers
        The controllers of a matrix, one for each output and input that it joins.
    """

    excitation_at: Literal["plant input", "velocity reference", "output"] = "plant input"
    entry_gain: float = 1.0
    input_logged: Literal["before", "after"] = "after"
    excitation_logged: Literal["before", "after"] = "after"
    output_logged: Literal["before", "after"] = "before"
    velocity: PIDSection | None = None
    position: PIDSection | None = None
    velocity_differenced: bool = False
    position_pd: PositionPDSection | None = None
    controllers: Annotated[list[ControllerSection], Field(max_length=CHANNELS_MAX**2)] = []

    def of_controller(self, output: str, input: str) -> LoopSection:
        """The description of the controller between two signals of a matrix alone; without one if there is none."""
        shared = {name: getattr(self, name) for name in ("input_logged", "excitation_logged", "output_logged")}
        for one in self.controllers:
            if (one.output, one.input) == (output, input):
                parts = ("velocity", "position", "velocity_differenced", "position_pd")
                return LoopSection(**shared, **{name: getattr(one, name) for name in parts})
        return LoopSection(**shared)

    def build(self, rate_hz: float) -> Loop:
        """The Loop of this description, recorded at `rate_hz`; ConfigError if its parts do not form one."""
        for name in ("velocity", "position", "position_pd"):
            part: _ControllerSection | None = getattr(self, name)
            if part is not None and abs(part.rate_hz * part.rate_divider / rate_hz - 1) > SAME_RATE:
                held = counted(part.rate_divider, "tick")
                raise ConfigError(
                    "rate-mismatch",
                    f"loop.{name} has a rate of {part.rate_hz:g} Hz and holds {held}, which gives "
                    f"{part.rate_hz * part.rate_divider:g} Hz, but the sampling rate is {rate_hz:g} Hz",
                    "set rate_divider to the sampling rate divided by the rate of the controller",
                    key=f"loop.{name}",
                    rate_hz=rate_hz,
                    controller_rate_hz=part.rate_hz,
                    rate_divider=part.rate_divider,
                )
        return core.Loop(
            feedback=self._feedback(),
            entry=self._entry(),
            input_logged=self.input_logged,
            excitation_logged=self.excitation_logged,
            output_logged=self.output_logged,
        )

    def described(self, rate_hz: float) -> Loop:
        """The same; UsageError without a controller."""
        loop = self.build(rate_hz)
        if loop.feedback is None:
            raise UsageError(
                "missing",
                "the loop is not described: its controllers are not known",
                "describe those of the drive under [loop] of an axis file (docs/how-to/loop.md), for example by the "
                f"line loop.velocity = {{gain = 0.25, integral_time_s = 0.1, rate_hz = {rate_hz:.12g}}}, and use it",
                argument="axis",
            )
        return loop

    def _feedback(self) -> Model | None:
        if self.position_pd is not None:
            if self.velocity or self.position:
                raise ConfigError(
                    "key-conflict",
                    "loop.position_pd is the whole controller",
                    "remove loop.velocity and loop.position",
                    key="loop.position_pd",
                )
            return core.PositionPD(**self.position_pd.model_dump())
        if self.velocity is None:
            if self.position is not None:
                raise ConfigError(
                    "incomplete",
                    "loop.position needs loop.velocity inside it",
                    "describe the velocity controller also",
                    key="loop.velocity",
                )
            return None
        velocity = core.PID(**self.velocity.model_dump())
        if self.position is None:
            return velocity
        return core.Cascade(velocity, core.PID(**self.position.model_dump()), self.velocity_differenced)

    def _entry(self) -> Model | None:
        if self.excitation_at == "plant input":
            return None if self.entry_gain == 1.0 else core.Gain(self.entry_gain)
        if self.excitation_at == "velocity reference":
            if self.velocity is None:
                raise ConfigError(
                    "incomplete",
                    "loop.excitation_at = 'velocity reference' needs loop.velocity",
                    "describe the velocity controller",
                    key="loop.velocity",
                )
            return self.entry_gain * core.PID(**self.velocity.model_dump())
        feedback = self._feedback()
        if feedback is None:
            raise ConfigError(
                "incomplete",
                "loop.excitation_at = 'output' needs the loop's controllers",
                "describe loop.velocity",
                key="loop.velocity",
            )
        return core.Gain(-self.entry_gain) * feedback
