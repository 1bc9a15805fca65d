"""The controllers whose parameters are tuned, with the derivatives of their response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from math import isfinite, log, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import PID, Cascade, Model, PositionPD, TuneError, integral
from livebode.dataclass import dataclass
from livebode_control.tuning.filters import Biquad, low_pass, notch

_NOTCH_MOVES = log(1.25)  # of its centre, in each direction
_DAMPING = (0.05, 1.5)
_DEPTH = (10 ** (-40 / 20), 1.0)
_LOW_PASS_DAMPING = 1 / sqrt(2)


@dataclass(frozen=True)
class TunedFeedback:
    """A controller with the filters behind it.

    Attributes
    ----------
    controller
        The described cascade with other gains.
    notches, low_passes
        Frequency in Hz, depth in dB and damping of each notch; corner in Hz of each low-pass.
    rate_hz
        Of the filters: that of the velocity controller.
    """

    controller: PID | Cascade | PositionPD
    notches: tuple[tuple[float, float, float], ...] = ()
    low_passes: tuple[float, ...] = ()
    rate_hz: float = 0.0

    @property
    def biquads(self) -> tuple[Biquad, ...]:
        """The filters as they are computed."""
        return (
            *(notch(f, depth, damping, self.rate_hz) for f, depth, damping in self.notches),
            *(low_pass(f, self.rate_hz) for f in self.low_passes),
        )

    @property
    def model(self) -> Model:
        """F with the filters, for a Loop."""
        return reduce(lambda behind, biquad: behind * biquad, self.biquads, self.controller)


class FeedbackStructure:
    """F as a function of the logarithms of its parameters: gains, times, and those of the filters.

    Parameters
    ----------
    controller
        The described feedback: terms that it does not have are not added.
    frequency_hz
        Where the response is needed, shape (frequencies,).
    notches_hz
        Centres about which the notches are searched.
    low_pass
        Whether there is a low-pass.
    fixed
        A feedback whose filters are in series, too, and are not tuned.

    Raises
    ------
    TuneError
        If the feedback is not a PID, a Cascade or a PositionPD.
    """

    def __init__(
        self,
        controller: Model | None,
        frequency_hz: Floats,
        notches_hz: Sequence[float] = (),
        *,
        low_pass: bool = False,
        fixed: TunedFeedback | None = None,
    ) -> None:
        if not isinstance(controller, PID | Cascade | PositionPD):
            raise TuneError(
                "controller-unsupported",
                f"the feedback is a {type(controller).__name__}, and only PID, Cascade and PositionPD are tuned",
                "describe the cascade under [loop] (docs/how-to/loop.md)",
                key="loop",
            )
        self.controller = controller
        self.frequency_hz = frequency_hz
        self.notches_hz = tuple(notches_hz)
        self.low_pass = low_pass
        self.fixed = fixed
        inner = controller.velocity if isinstance(controller, Cascade) else controller
        self.rate_hz = inner.rate_hz
        self._tangent = np.tan(np.pi * frequency_hz / self.rate_hz)
        self._inner = inner
        self.sign = -1.0 if (inner.gain if isinstance(inner, PID) else inner.velocity_gain) < 0 else 1.0
        filters = fixed.biquads if fixed is not None else ()
        untuned = [part.response(frequency_hz) for part in (_timing(inner), *filters)]
        self._untuned = self.sign * np.prod(untuned, axis=0)
        self.names, self.start, self.low, self.high = self._variables()
        if isinstance(inner, PID):
            self._integral = integral(frequency_hz, inner.rate_hz, inner.integrator)
            slope = 1 / integral(frequency_hz, inner.rate_hz, "backward")
            self._slope = slope / (1 + inner.derivative_filter_s * slope)
        else:
            shape = replace(inner, position_gain=0.0, velocity_gain=1.0)
            self._slope = shape.law(frequency_hz)
        if isinstance(controller, Cascade):
            self._position = controller.outer(frequency_hz)

    def _variables(self) -> tuple[tuple[str, ...], Floats, Floats, Floats]:
        """Names, described values and limits, all as logarithms; a parameter that is not described is not one."""
        inner, tick_s = self._inner, 1 / self._inner.rate_hz
        rows: list[tuple[str, float, float, float]] = []
        if isinstance(inner, PID):
            rows.append(("gain", abs(inner.gain), 0.0, np.inf))
            if isfinite(inner.integral_time_s):
                rows.append(("integral_time", inner.integral_time_s, 4 * tick_s, 100.0))
            if inner.derivative_time_s:
                rows.append(("derivative_time", inner.derivative_time_s, 1e-3 * tick_s, 10.0))
        else:
            rows += [
                ("gain", abs(inner.velocity_gain), 0.0, np.inf),
                ("position_gain", inner.position_gain, 1e-3, inner.rate_hz),
            ]
        if isinstance(self.controller, Cascade):
            position = getattr(self.controller.position, "gain", 1.0)
            rows.append(("position_gain", position, 1e-3 * position, inner.rate_hz))
        for i, notch_hz in enumerate(self.notches_hz):
            turn = np.exp(_NOTCH_MOVES)
            rows += [
                (f"notch{i}_frequency", notch_hz, notch_hz / turn, min(notch_hz * turn, 0.48 * inner.rate_hz)),
                (f"notch{i}_depth", 0.3, *_DEPTH),
                (f"notch{i}_damping", 0.5, *_DAMPING),
            ]
        if self.low_pass:
            rows.append(("low_pass", 0.45 * inner.rate_hz, 0.005 * inner.rate_hz, 0.48 * inner.rate_hz))
        with np.errstate(divide="ignore"):
            numbers = np.log(np.array([row[1:] for row in rows]))
        return tuple(row[0] for row in rows), numbers[:, 0], numbers[:, 1], numbers[:, 2]

    @property
    def of_position(self) -> bool:
        """Whether the measured output is a position."""
        return isinstance(self.controller, PositionPD)

    def index(self, name: str) -> int | None:
        """Column of a parameter; None where the structure does not have it."""
        return self.names.index(name) if name in self.names else None

    def only(self, columns: NDArray[np.bool_]) -> FeedbackStructure:
        """This structure at some of its frequencies."""
        return FeedbackStructure(
            self.controller, self.frequency_hz[columns], self.notches_hz, low_pass=self.low_pass, fixed=self.fixed
        )

    def response(self, x: Floats) -> tuple[Complex, Complex]:
        """F, shape (frequencies,), and the derivative of log F to each parameter, (parameters, frequencies)."""
        value = dict(zip(self.names, np.exp(x).tolist()))
        slopes = np.zeros((len(x), len(self.frequency_hz)), dtype=np.complex128)
        slopes[0] = 1.0
        inner = self._inner_law(value, slopes)
        if isinstance(self.controller, Cascade):
            described = float(np.exp(self.start[self.names.index("position_gain")]))
            outer = value["position_gain"] / described * self._position
            slopes[self.names.index("position_gain")] = outer / (1 + outer)
            inner = inner * (1 + outer)
        f = inner * self._untuned
        for i in range(len(self.notches_hz)):
            f = f * self._notch(value, i, slopes)
        if self.low_pass:
            f = f * self._low_pass(value["low_pass"], slopes)
        return f, slopes

    def _inner_law(self, value: dict[str, float], slopes: Complex) -> Complex:
        """The innermost controller without hold and delay."""
        if not isinstance(self._inner, PID):
            law = value["position_gain"] + self._slope
            slopes[self.names.index("position_gain")] = value["position_gain"] / law
            return np.asarray(value["gain"] * law)
        law = np.ones(len(self.frequency_hz), dtype=np.complex128)
        parts = {}
        if "integral_time" in value:
            part = self._integral / value["integral_time"]
            law, parts["integral_time"] = law + part, -part
        if "derivative_time" in value:
            part = value["derivative_time"] * self._slope
            law, parts["derivative_time"] = law + part, part
        for name, part in parts.items():
            slopes[self.names.index(name)] = part / law
        return value["gain"] * law

    def _notch(self, value: dict[str, float], number: int, slopes: Complex) -> Complex:
        """That of `livebode_control.tuning.filters.notch`, as a function of tan(πf/rate)."""
        notch_hz, depth, damping = (value[f"notch{number}_{name}"] for name in ("frequency", "depth", "damping"))
        v, dv = self._warped(notch_hz)
        above, below = 1 - v**2 + 2j * depth * damping * v, 1 - v**2 + 2j * damping * v
        first = self.names.index(f"notch{number}_frequency")
        up, down = 2j * depth * damping * v / above, 2j * damping * v / below
        slopes[first] = dv * ((up - 2 * v**2 / above) - (down - 2 * v**2 / below))
        slopes[first + 1] = up
        slopes[first + 2] = up - down
        return np.asarray(above / below)

    def _low_pass(self, corner_hz: float, slopes: Complex) -> Complex:
        v, dv = self._warped(corner_hz)
        below = 1 - v**2 + 2j * _LOW_PASS_DAMPING * v
        slopes[self.names.index("low_pass")] = -dv * (2j * _LOW_PASS_DAMPING * v - 2 * v**2) / below
        return np.asarray(1 / below)

    def _warped(self, at_hz: float) -> tuple[Floats, float]:
        """Frequency over `at_hz`, warped as by the bilinear transformation, and its logarithmic derivative to it."""
        angle = pi * at_hz / self.rate_hz
        return self._tangent / np.tan(angle), -float(angle / (np.sin(angle) * np.cos(angle)))

    def feedback(self, x: Floats) -> TunedFeedback:
        """The controller with these parameters; a notch of less than 0.5 dB is left out."""
        value = dict(zip(self.names, np.exp(x).tolist()))
        notches = []
        for i in range(len(self.notches_hz)):
            depth_db = -20 * np.log10(value[f"notch{i}_depth"])
            if depth_db > 0.5:
                notches.append((value[f"notch{i}_frequency"], float(depth_db), value[f"notch{i}_damping"]))
        low_passes = [value["low_pass"]] if self.low_pass else []
        if self.fixed is not None:
            notches += self.fixed.notches
            low_passes += self.fixed.low_passes
        return TunedFeedback(self._controller(value), tuple(notches), tuple(low_passes), self.rate_hz)

    def _controller(self, value: dict[str, float]) -> PID | Cascade | PositionPD:
        inner = self._inner
        if isinstance(inner, PositionPD):
            return replace(inner, velocity_gain=self.sign * value["gain"], position_gain=value["position_gain"])
        pid = replace(
            inner,
            gain=self.sign * value["gain"],
            integral_time_s=value.get("integral_time", inner.integral_time_s),
            derivative_time_s=value.get("derivative_time", inner.derivative_time_s),
        )
        if isinstance(self.controller, Cascade):
            position = replace(self.controller.position, gain=value["position_gain"])  # type: ignore[call-arg]
            return Cascade(pid, position)
        return pid


def _timing(part: PID | PositionPD) -> PID:
    """Hold and delay of a controller: it with a law of one."""
    return PID(
        gain=1.0,
        rate_hz=part.rate_hz,
        rate_divider=part.rate_divider,
        hold=part.hold,
        delay_ticks=part.delay_ticks,
    )
