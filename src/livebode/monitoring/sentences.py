"""Events of the monitoring, in sentences that a maintenance person understands."""

from __future__ import annotations

from math import exp, expm1
from typing import TYPE_CHECKING, Any

from livebode.monitoring import evidence as word
from livebode.monitoring.offset import FAR
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.nouns import Event
from livebode.nouns.clock import moment

if TYPE_CHECKING:
    from livebode.monitoring.alarms import Alarm
    from livebode.monitoring.machine import Machine
    from livebode.monitoring.naming import Change

WHAT = {
    "stiffness": "the belt's stiffness",
    "load": "the moved mass",
    "damping": "the belt's damping",
    "inertia": "the motor's inertia",
}


def changed(alarm: Alarm, sample: int, time_s: float) -> Event:
    """Something changed, as is known at this sample and time."""
    message = f"Since {moment(alarm.since_s)} {_amount(alarm.change, alarm.now, alarm.bound)} than in the baseline"
    if (rival := alarm.rival) is not None:
        message += f"; it may also be that {_amount(rival, rival.amount, rival.bound)}"
    if alarm.change.place is None and abs(alarm.now) > FAR:
        message += ". That is so far from the baseline that it may be another machine; the amount is rough until all "
        message += "that differs has its name"
    return Event("change", sample, time_s, message + ".", about(alarm))


def far_away(alarm: Alarm, sample: int, time_s: float) -> Event:
    """So much changed that no single change explains it."""
    message = (
        f"Since {moment(alarm.since_s)} the machine is so far from the baseline that no single change explains it: it "
        "may be another machine. Amounts follow where the model can come along."
    )
    return Event("change", sample, time_s, message, about_far(alarm))


def about_far(alarm: Alarm) -> dict[str, Any]:
    """The same as plain data: all but the moment and the way is not known."""
    unknown = {"amount_percent": None, "bound_percent": None, "place_m": None, "place_width_m": None}
    return about(alarm) | unknown | {"what": "machine", "may_also_be": None}


def corrected(alarm: Alarm, told: float, sample: int, time_s: float) -> Event:
    """The amount of a change that was told, once another that looked like a part of it has its name."""
    message = (
        f"With all changes since then allowed for, {_amount(alarm.change, alarm.now, alarm.bound)} than in the "
        f"baseline, not {_size(told)} as told before."
    )
    return Event("change-corrected", sample, time_s, message, about(alarm) | {"told_percent": percent(told)})


def joint(alarms: list[Alarm]) -> str:
    """What stands, estimated together, in half a sentence."""
    if not alarms:
        return ""
    return ": " + "; ".join(_amount(alarm.change, alarm.now, alarm.bound) for alarm in alarms)


def cleared(alarm: Alarm, sample: int, time_s: float) -> Event:
    """A change that was alarmed has gone."""
    where = _where(alarm.change)
    name = WHAT[DIRECTIONS[alarm.change.direction]]
    message = (
        f"At {moment(time_s)} {name}{where} is as in the baseline again; it had changed since {moment(alarm.since_s)}."
    )
    return Event("change-cleared", sample, time_s, message, about(alarm))


def unknown(
    status: str, machine: Machine, position_m: float, speed_m_per_s: float, sample: int, time_s: float
) -> Event:
    """The machine does what was not learned."""
    if status == word.FAST:
        message = (
            f"The baseline knows speeds up to {machine.fastest_m_per_s:.3g} a second, and the axis goes at "
            f"{abs(speed_m_per_s):.3g}; such motion is not judged. Learn from a run that holds it."
        )
    else:
        message = (
            f"The baseline does not know the axis at position {position_m:.3g}; it is not judged there. "
            "Learn from a run that goes there."
        )
    details = {"reason": status, "position_m": position_m, "speed_m_per_s": speed_m_per_s}
    return Event("baseline-unknown", sample, time_s, message, details)


def about(alarm: Alarm) -> dict[str, Any]:
    """An alarm as plain data; amounts in percent."""
    place, rival = alarm.change.place, alarm.rival
    return {
        "what": DIRECTIONS[alarm.change.direction],
        "amount_percent": percent(alarm.now),
        "bound_percent": bound_percent(alarm.now, alarm.bound),
        "since_s": alarm.since_s,
        "since_sample": alarm.since_sample,
        "place_m": place.centre_m if place else None,
        "place_width_m": 2.355 * place.width_m if place else None,  # at half its depth
        "named_from_m": alarm.way_m[0],
        "named_to_m": alarm.way_m[1],
        "may_also_be": DIRECTIONS[rival.direction] if rival else None,
    }


def percent(log_amount: float) -> float:
    return 100 * expm1(log_amount)


def bound_percent(log_amount: float, log_bound: float) -> float:
    """Half-width in percent of the baseline."""
    return 100 * log_bound * exp(log_amount)


def _amount(change: Change, amount: float, bound: float) -> str:
    within = bound_percent(amount, bound)
    digits = 2 if within < 0.1 else 1
    size = f"{abs(percent(amount)):.{digits}f} ± {within:.{digits}f} %"
    return f"{WHAT[DIRECTIONS[change.direction]]}{_where(change)} is {size} {'less' if amount < 0 else 'more'}"


def _size(amount: float) -> str:
    return f"{abs(percent(amount)):.1f} % {'less' if amount < 0 else 'more'}"


def _where(change: Change) -> str:
    return f" around position {change.place.centre_m:.3g}" if change.place else ""
