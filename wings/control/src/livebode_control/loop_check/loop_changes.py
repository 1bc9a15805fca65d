"""Single changes of the description of a loop: what somebody may have described wrongly."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf

from livebode.configuration import LoopSection, PIDSection
from livebode.dataclass import dataclass

_RULES = ("backward", "forward", "trapezoidal", "continuous")
_WHERE = ("plant input", "velocity reference", "output")
_DELAY_TICKS_MAX = 3  # by which a described delay may be wrong
_DIVIDERS = range(1, 17)  # of a position controller


@dataclass(frozen=True)
class LoopChange:
    """One word of the description that is replaced, or one number that is fitted.

    Attributes
    ----------
    kind
        gain, integrator, delay, hold, logging, left out, filter, time constant, injection, rate: what is wrong.
    key
        Its key in the configuration, such as "loop.velocity.integrator".
    described
        Value of the key in the description.
    word
        The value to test; None if it is a number that is fitted.
    apply
        The description with another value of the key.
    starts
        Values from which the number is fitted; empty for a word.
    unit
        Of the number.
    least
        Smallest possible number.
    """

    kind: str
    key: str
    described: object
    word: object
    apply: Callable[[object], LoopSection]
    starts: tuple[float, ...] = ()
    unit: str = ""
    least: float = -inf


def single_changes(section: LoopSection, rate_hz: float) -> list[LoopChange]:
    """All of a description, of signals that are recorded at this rate."""
    changes = list(_of_loop(section))
    for name in ("velocity", "position", "position_pd"):
        if getattr(section, name) is not None:
            changes += _of_controller(section, name)
            changes += _other_rates(section, name) if name != "velocity" else ()
    if section.velocity is not None and section.position is None:
        changes += _position_left_out(section, rate_hz)
    return changes


def _of_loop(section: LoopSection) -> Iterator[LoopChange]:
    for name in ("input", "excitation", "output"):
        key, now = f"{name}_logged", getattr(section, f"{name}_logged")
        yield _word(section, "", "logging", key, "before" if now == "after" else "after")
    for place in _WHERE:
        possible = section.velocity is not None or place != "velocity reference"
        if place != section.excitation_at and possible:
            yield _word(section, "", "injection", "excitation_at", place)
    if section.position is not None:
        yield _word(section, "", "hold", "velocity_differenced", not section.velocity_differenced)
    yield _number(section, "", "gain", "entry_gain", (section.entry_gain,))


def _of_controller(section: LoopSection, name: str) -> Iterator[LoopChange]:
    part = getattr(section, name)
    tick_s = 1 / part.rate_hz
    for ticks in range(max(0, part.delay_ticks - _DELAY_TICKS_MAX), part.delay_ticks + _DELAY_TICKS_MAX + 1):
        if ticks != part.delay_ticks:
            yield _word(section, name, "delay", "delay_ticks", ticks)
    if part.rate_divider > 1:
        yield _word(section, name, "hold", "hold", "none" if part.hold == "zero-order" else "zero-order")
    filters = (part.lowpass_s,) if part.lowpass_s else (tick_s, 10 * tick_s)
    yield _number(section, name, "filter", "lowpass_s", filters, "s", least=0.0)
    if name == "position":
        yield LoopChange(
            "left out", "loop.position", "described", "none", lambda _: section.model_copy(update={"position": None})
        )
    if not isinstance(part, PIDSection):
        yield _word(section, name, "filter", "smoothed", not part.smoothed)
        yield _number(section, name, "gain", "position_gain", (part.position_gain,), "1/s")
        yield _number(section, name, "gain", "velocity_gain", (part.velocity_gain,))
        return
    yield _number(section, name, "gain", "gain", (part.gain,))
    if part.integral_time_s < inf:
        yield _number(
            section, name, "time constant", "integral_time_s", (part.integral_time_s,), "s", least=tick_s / 10
        )
        for rule in _RULES:
            if rule != part.integrator:
                yield _word(section, name, "integrator", "integrator", rule)
    else:
        yield _number(section, name, "left out", "integral_time_s", (1000 * tick_s,), "s", least=tick_s / 10)
    slope = (part.derivative_time_s,) if part.derivative_time_s else (tick_s,)
    yield _number(section, name, "time constant", "derivative_time_s", slope, "s", least=0.0)
    if part.derivative_time_s:
        late = (part.derivative_filter_s,) if part.derivative_filter_s else (tick_s,)
        yield _number(section, name, "filter", "derivative_filter_s", late, "s", least=0.0)


def _position_left_out(section: LoopSection, rate_hz: float) -> Iterator[LoopChange]:
    """A position loop at each rate that the rate of the velocity loop permits."""
    assert section.velocity is not None
    for divider in (section.velocity.rate_divider * factor for factor in _DIVIDERS):

        def with_position(gain: object, divider: int = divider) -> LoopSection:
            position = PIDSection(gain=float(gain), rate_hz=rate_hz / divider, rate_divider=divider)  # type: ignore[arg-type]
            return section.model_copy(update={"position": position})

        key = f"loop.position (rate_divider {divider}).gain"
        yield LoopChange("left out", key, "none", None, with_position, (1.0,), "1/s")


def _other_rates(section: LoopSection, name: str) -> Iterator[LoopChange]:
    """A controller at the other rates that the rate of the velocity loop permits."""
    part = getattr(section, name)
    inner = section.velocity.rate_divider if name == "position" and section.velocity is not None else 1
    for divider in (inner * factor for factor in _DIVIDERS):

        def at_rate(divider: object) -> LoopSection:
            assert isinstance(divider, int)
            rate_hz = part.rate_hz * part.rate_divider / divider
            other = part.model_copy(update={"rate_hz": rate_hz, "rate_divider": divider})
            return section.model_copy(update={name: other})

        if divider != part.rate_divider:
            yield LoopChange("rate", f"loop.{name}.rate_divider", part.rate_divider, divider, at_rate)


def _word(section: LoopSection, name: str, kind: str, key: str, word: object) -> LoopChange:
    place, described, apply = _place(section, name, key)
    return LoopChange(kind, place, described, word, apply)


def _number(
    section: LoopSection,
    name: str,
    kind: str,
    key: str,
    starts: tuple[float, ...],
    unit: str = "",
    *,
    least: float = -inf,
) -> LoopChange:
    place, described, apply = _place(section, name, key)
    return LoopChange(kind, place, described, None, apply, starts, unit, least)


def _place(section: LoopSection, name: str, key: str) -> tuple[str, object, Callable[[object], LoopSection]]:
    if not name:
        return f"loop.{key}", getattr(section, key), lambda value: section.model_copy(update={key: value})
    part = getattr(section, name)

    def apply(value: object) -> LoopSection:
        return section.model_copy(update={name: part.model_copy(update={key: value})})

    return f"loop.{name}.{key}", getattr(part, key), apply
