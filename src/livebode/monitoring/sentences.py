"""Events of the monitoring, in sentences that a maintenance person understands."""

from __future__ import annotations

from math import expm1
from typing import TYPE_CHECKING, Any

from livebode.monitoring import evidence as word
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.nouns import Event

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


def changed(
    alarm: Alarm, others: list[Change], way_m: tuple[float, float], sample: int, time_s: float
) -> Event:
    """Something changed; `others` are changes that would explain it nearly as well, `way_m` where it was seen."""
    details = about(alarm, others) | {"seen_from_m": way_m[0], "seen_to_m": way_m[1]}
    message = f"Since {alarm.since_s:.1f} s {_amount(alarm.change)}{_where(alarm.change)} than the baseline"
    if others:
        message += f"; it may also be {' or '.join(_amount(c) for c in others)}"
    return Event("change", sample, time_s, message + ".", details)


def cleared(alarm: Alarm, sample: int, time_s: float) -> Event:
    """A change that was alarmed has gone."""
    where = _where(alarm.change)
    name = WHAT[DIRECTIONS[alarm.change.direction]]
    message = f"At {time_s:.1f} s {name}{where} is as in the baseline again; it had changed since {alarm.since_s:.1f} s."
    return Event("change-cleared", sample, time_s, message, about(alarm, []))


def unknown(status: str, machine: Machine, position_m: float, speed_m_per_s: float, sample: int, time_s: float) -> Event:
    """The machine does what was not learned."""
    if status == word.FAST:
        message = (
            f"The baseline knows speeds up to {machine.fastest_m_per_s:.3g} m/s, and the axis goes at "
            f"{abs(speed_m_per_s):.3g} m/s; such motion is not judged. Learn from a run that holds it."
        )
    else:
        message = (
            f"The baseline does not know the axis at {position_m:.2f} m; it is not judged there. "
            "Learn from a run that goes there."
        )
    details = {"reason": status, "position_m": position_m, "speed_m_per_s": speed_m_per_s}
    return Event("baseline-unknown", sample, time_s, message, details)


def about(alarm: Alarm, others: list[Change]) -> dict[str, Any]:
    """An alarm as plain data; amounts in percent."""
    change = alarm.change
    return {
        "what": DIRECTIONS[change.direction],
        "amount_percent": percent(change.amount),
        "bound_percent": 100 * change.bound,
        "now_percent": percent(alarm.now),
        "since_s": alarm.since_s,
        "since_sample": alarm.since_sample,
        "place_m": change.place.centre_m if change.place else None,
        "place_width_m": 2.355 * change.place.width_m if change.place else None,  # at half its depth
        "may_also_be": [
            {"what": DIRECTIONS[c.direction], "amount_percent": percent(c.amount), "place_m": c.place.centre_m if c.place else None} for c in others
        ],
    }


def percent(log_amount: float) -> float:
    return 100 * expm1(log_amount)


def _amount(change: Change) -> str:
    amount, bound = percent(change.amount), 100 * change.bound
    digits = 2 if bound < 0.1 else 1
    word_ = "less" if amount < 0 else "more"
    return f"{WHAT[DIRECTIONS[change.direction]]} is {abs(amount):.{digits}f} ± {bound:.{digits}f} % {word_}"


def _where(change: Change) -> str:
    return f" around {change.place.centre_m:.2f} m" if change.place else ""
