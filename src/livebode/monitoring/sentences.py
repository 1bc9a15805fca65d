"""Messages of the monitoring's Events, for maintenance staff."""

from __future__ import annotations

from math import exp, expm1, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Event, moment
from livebode.core import moment as clock_moment
from livebode.language import Message
from livebode.monitoring import evidence as word
from livebode.monitoring.change_date import ChangeDate
from livebode.monitoring.monitored_time import with_more
from livebode.monitoring.sensitivity import DIRECTIONS, FAR
from livebode.monitoring.table import ALL, ORDERS, STILL, ScheduleTable

if TYPE_CHECKING:
    from livebode.monitoring.alarms import Alarm
    from livebode.monitoring.covariates import Covariates
    from livebode.monitoring.evidence import Evidence
    from livebode.monitoring.machine import LearnedMachine
    from livebode.monitoring.naming import NamedChange

WHAT = {
    "stiffness": Message("the belt's stiffness"),
    "load": Message("the moved mass"),
    "damping": Message("the belt's damping"),
    "inertia": Message("the motor's inertia"),
}
_FAR_AWAY = Message(
    "This is so far from the baseline that it may be another machine; the amount is approximate until all differences "
    "are identified."
)


def changed(alarm: Alarm, sample: int, time_s: float, *, within_run: bool = False) -> Event:
    """A change, as known at this sample and time; `within_run`: relative to the earlier part of this run."""
    change = _change(alarm.change, alarm.now, alarm.bound, within_run)
    if (rival := alarm.rival) is None:
        message = Message("Since {since} {change}.", since=alarm.date.text, change=change)
    else:
        message = Message(
            "Since {since} {change}; a possible alternative: {alternative}.",
            since=alarm.date.text,
            change=change,
            alternative=_amount(rival, rival.amount, rival.bound),
        )
    if alarm.change.place is None and abs(alarm.now) > FAR:
        message = Message.sentences([message, _FAR_AWAY])
    return Event("change", sample, time_s, message, about(alarm, within_run=within_run))


def far_away(alarm: Alarm, sample: int, time_s: float) -> Event:
    """A change so large that no single change explains it."""
    message = Message(
        "Since {since} the machine is so far from the baseline that no single change explains it: it may be "
        "another machine. Amounts are reported as soon as the model can follow.",
        since=alarm.date.text,
    )
    return Event("change", sample, time_s, message, about_far(alarm))


def about_far(alarm: Alarm) -> dict[str, Any]:
    """Details of such an alarm as plain data: only the time and the range of positions are known."""
    unknown = {"amount_percent": None, "bound_percent": None, "place_m": None, "place_width_m": None}
    return about(alarm) | unknown | {"what": "machine", "may_also_be": None}


def corrected(alarm: Alarm, reported: float, sample: int, time_s: float, *, within_run: bool = False) -> Event:
    """The corrected amount of a reported change, after another change was identified that seemed part of it."""
    message = Message(
        "With all changes since then allowed for, {change}, not {told} as reported earlier.",
        change=_change(alarm.change, alarm.now, alarm.bound, within_run),
        told=_size(reported),
    )
    details = about(alarm, within_run=within_run) | {"told_percent": percent(reported)}
    return Event("change-corrected", sample, time_s, message, details)


def joint(alarms: list[Alarm]) -> list[Message]:
    """The active changes, estimated together."""
    return [_amount(alarm.change, alarm.now, alarm.bound) for alarm in alarms]


def cleared(alarm: Alarm, sample: int, time_s: float, *, within_run: bool = False) -> Event:
    """An alarmed change has disappeared."""
    message = Message(
        "At {time} {part} is as {before} again; it had changed since {since}.",
        time=moment(time_s),
        part=_part(alarm.change),
        before=_reference(within_run),
        since=moment(alarm.date.since_s),
    )
    return Event("change-cleared", sample, time_s, message, about(alarm, within_run=within_run))


def unknown(machine: LearnedMachine, seen: Evidence, row: int) -> Event:
    """The machine is outside of the learned range in this window."""
    status, position_m, speed_m_per_s = str(seen.status[row]), seen.position_m[row], seen.speed_m_per_s[row]
    details = {"reason": status, "position_m": float(position_m), "speed_m_per_s": float(speed_m_per_s)}
    if status == word.FAST:
        message = Message(
            "The baseline covers speeds up to {fastest:.3g} a second, but the axis moves at {speed:.3g}: such "
            "motion is not monitored. Add a run with such speeds and learn again.",
            fastest=machine.fastest_m_per_s,
            speed=abs(speed_m_per_s),
        )
    elif status == word.AMPLITUDE:
        ratio = float(machine.amplitude.excess(seen.amplitude[[row]])[0])
        message = Message(
            "The excitation is {ratio:.2g} times as strong as in the learned runs, and may reverse the motion at "
            "{speed:.3g} a second: such motion is not monitored. Add a run with this excitation and learn again.",
            ratio=ratio,
            speed=abs(speed_m_per_s),
        )
    elif status in (word.COVARIATE, word.NO_COVARIATE):
        message = _not_covered(machine.covariates, seen.covariate[row])
        details |= dict(zip(machine.covariates.names, seen.covariate[row].tolist()))
    else:
        message = Message(
            "The baseline does not cover position {position:.3g}: the axis is not monitored there. Add a run "
            "with such positions and learn again.",
            position=position_m,
        )
    return Event("baseline-unknown", int(seen.sample[row]), float(seen.time_s[row]), message, details)


def offset_unknown(machine: LearnedMachine, error: float, sample: int, time_s: float) -> Event:
    """The windows of this run do not determine its offset from the baseline; `error` is in smallest changes."""
    between, smallest = machine.between, machine.held.smallest
    assert between is not None
    along = np.flatnonzero(between.dominant(smallest))
    parts = [WHAT[DIRECTIONS[j]] for j in along]
    size = np.abs(between.direction[along]) * 100
    beyond = ", ".join(f"{3 * between.spread * s:.2g} %" for s in size)
    message = Message(
        "The learned runs differ from each other in {parts}, and the windows of this run determine its own offset only "
        "to ± {reachable_percent:.2g} %. Until it is known better, such a change is detected only beyond {beyond} from "
        "the baseline. Use a stronger excitation, or learn with the cause as a covariate.",
        parts=Message.conjunction(parts),
        reachable_percent=float(error * size[0]),
        beyond=beyond,
    )
    return Event("baseline-unknown", sample, time_s, message, {"reason": word.OFFSET})


def _not_covered(covariates: Covariates, value: Floats) -> Message:
    """The first covariate without a value, or outside of the learned range."""
    for i, name in enumerate(covariates.names):
        if not isfinite(value[i]):
            return Message(
                "The covariate {covariate} has no value; the machine is not monitored without it. Check that channel.",
                covariate=repr(name),
            )
    beside = np.maximum(covariates.low - value, value - covariates.high) / covariates.half_range
    i = int(np.argmax(beside))
    return Message(
        "The baseline covers {covariate} from {learned_low:.4g} to {learned_high:.4g}, but it is {value:.4g}: the "
        "machine is not monitored there. Add a run with such values and learn again.",
        covariate=repr(covariates.names[i]),
        learned_low=covariates.low[i],
        learned_high=covariates.high[i],
        value=value[i],
    )


def about(alarm: Alarm, *, within_run: bool = False) -> dict[str, Any]:
    """An alarm as plain data; amounts in percent of the reference: the baseline, or this run before the change."""
    place, rival = alarm.change.place, alarm.rival
    return {
        "what": DIRECTIONS[alarm.change.direction],
        "amount_percent": percent(alarm.now),
        "bound_percent": bound_percent(alarm.now, alarm.bound),
        **alarm.date.plain(),
        "place_m": place.centre_m if place else None,
        "place_width_m": 2.355 * place.width_m if place else None,  # at half its depth
        "named_from_m": alarm.way_m[0],
        "named_to_m": alarm.way_m[1],
        "may_also_be": DIRECTIONS[rival.direction] if rival else None,
        "reference": "run" if within_run else "baseline",
    }


def percent(log_amount: float) -> float:
    return 100 * expm1(log_amount)


def bound_percent(log_amount: float, log_bound: float) -> float:
    """Half-width in percent of the baseline."""
    return 100 * log_bound * exp(log_amount)


def _reference(within_run: bool) -> Message:
    return Message("before in this run") if within_run else Message("in the baseline")


def less_or_more(amount: float) -> Message:
    """The direction of a change."""
    return Message("less") if amount < 0 else Message("more")


def _change(change: NamedChange, amount: float, bound: float, within_run: bool) -> Message:
    """A change relative to the baseline, or to the earlier part of this run."""
    return Message(
        "{part} is {size} % {way} than {reference}",
        part=_part(change),
        size=_percent(amount, bound),
        way=less_or_more(amount),
        reference=_reference(within_run),
    )


def _amount(change: NamedChange, amount: float, bound: float) -> Message:
    size, way = _percent(amount, bound), less_or_more(amount)
    return Message("{part} is {size} % {way}", part=_part(change), size=size, way=way)


def _size(amount: float) -> Message:
    return Message("{size:.1f} % {way}", size=abs(percent(amount)), way=less_or_more(amount))


def _percent(amount: float, bound: float) -> Message:
    """An amount in percent with its bound."""
    size, within = abs(percent(amount)), bound_percent(amount, bound)
    if within < 0.1:
        return Message("{size:.2f} ± {bound:.2f}", size=size, bound=within)
    return Message("{size:.1f} ± {bound:.1f}", size=size, bound=within)


def _part(change: NamedChange) -> Message:
    part = WHAT[DIRECTIONS[change.direction]]
    if change.place is None:
        return part
    return Message("{part} around position {position:.3g}", part=part, position=change.place.centre_m)


_NAMED = 4


def differs(
    table: ScheduleTable, changed: NDArray[np.bool_], amount: Floats, bound: Floats, moment: Floats, date: ChangeDate
) -> Event:
    """A change; `moment` is schedule, sample and time of every row since it began."""
    if table.what == "lines":
        amount, bound = _polar(amount, bound)
    components = sorted(np.flatnonzero(changed), key=lambda j: -abs(amount[j]) / bound[j])
    items = [_item(table, int(j), float(amount[j]), float(bound[j])) for j in components]
    changes = with_more([_phrase(item) for item in items[:_NAMED]], len(items) - _NAMED)
    schedule = moment[:, 0][np.isfinite(moment[:, 0])]
    where = [float(schedule.min()), float(schedule.max())] if schedule.size else None
    details = {
        "what": table.what,
        "changes": items,
        **date.plain(),
        "seen_at": where,
    }
    if where is None:
        message = Message(
            "Since {since} the machine differs from the baseline: {differences}.", since=date.text, differences=changes
        )
    else:
        message = Message(
            "Since {since} the machine differs from the baseline, seen from {low:.3g} to {high:.3g}: {differences}.",
            since=date.text,
            low=where[0],
            high=where[1],
            differences=changes,
        )
    return Event("change", int(moment[-1, 1]), float(moment[-1, 2]), message, details)


def _polar(amount: Floats, bound: Floats) -> tuple[Floats, Floats]:
    """From real and imaginary part of relative deviations, line by line, to those of magnitude and phase, rad."""
    quotient = 1 + amount[0::2] + 1j * amount[1::2]
    size = np.abs(quotient)
    along, across = np.abs(quotient.real / size), np.abs(quotient.imag / size)
    real, imaginary = (np.where(np.isfinite(b), b, 0.0) for b in (bound[0::2], bound[1::2]))
    magnitude = np.hypot(along * real, across * imaginary)
    phase = np.hypot(across * real, along * imaginary) / size
    amounts = np.stack([size - 1, np.angle(quotient)], axis=1).ravel()
    return amounts, np.stack([magnitude, phase], axis=1).ravel()


def table_cleared(table: ScheduleTable, sample: int, time_s: float) -> Event:
    """All changes have disappeared."""
    message = Message("At {time} {parts} with the baseline again.", time=clock_moment(time_s), parts=_KIND[table.what])
    return Event("change-cleared", sample, time_s, message, {"what": table.what})


def table_unknown(schedule: float, sample: int, time_s: float) -> Event:
    """The machine is at a position or moves in a direction that was not learned."""
    message = Message(
        "The baseline does not cover {schedule:.4g} in this direction: the machine is not monitored there. Add "
        "a run with such motion and learn again.",
        schedule=schedule,
    )
    return Event("baseline-unknown", sample, time_s, message, {"reason": "place"})


_KIND = {
    "lines": Message("the responses agree"),
    "parameters": Message("the parameters agree"),
    "friction": Message("the friction agrees"),
    "orders": Message("the orders agree"),
}


def _item(table: ScheduleTable, component: int, amount: float, bound: float) -> dict[str, Any]:
    if table.what == ORDERS:
        return _order(table, component, amount, bound)
    if table.what != "lines":
        return {
            "name": table.names[component],
            "of": "value",
            "unit": "%",
            "amount": 100 * amount,
            "bound": 100 * bound,
        }
    name = table.names[component // 2]
    if component % 2:
        return {"name": name, "of": "phase", "unit": "°", "amount": np.degrees(amount), "bound": np.degrees(bound)}
    return {"name": name, "of": "magnitude", "unit": "%", "amount": 100 * amount, "bound": 100 * bound}


def _order(table: ScheduleTable, component: int, amount: float, bound: float) -> dict[str, Any]:
    """An order, from the deviation of the cube root of the square of its amplitude; or all orders of a shaft."""
    name, factor = table.names[component], max(1 + amount, 0.0) ** 1.5
    wide = 1.5 * np.sqrt(max(1 + amount, 0.0)) * bound
    if name.startswith(ALL):
        return {"name": name, "of": "value", "unit": "%", "amount": 100 * (factor - 1), "bound": 100 * wide}
    before = float(table.mean[0, STILL, component].real) ** 1.5
    return {
        "name": name, "of": "amplitude", "unit": table.unit, "amount": factor * before, "bound": wide * before,
        "baseline": before,
    }  # fmt: skip


def _phrase(item: dict[str, Any]) -> Message:
    name, facts = item["name"], {"amount": item["amount"], "bound": item["bound"]}
    if item["of"] == "magnitude":
        return Message("magnitude at {line} {amount:+.1f} ± {bound:.1f} %", line=name, **facts)
    if item["of"] == "phase":
        return Message("phase at {line} {amount:+.1f} ± {bound:.1f} °", line=name, **facts)
    part = name if isinstance(name, Message) else Message(name.replace("_", " "))
    if item["of"] == "value":
        return Message("{part} {amount:+.1f} ± {bound:.1f} %", part=part, **facts)
    size = Message("{amount:.3g} ± {bound:.2g}", **facts)
    if item["unit"]:
        size = Message("{amount:.3g} ± {bound:.2g} {unit}", unit=item["unit"], **facts)
    return Message("{part} {size}, {before:.3g} in the baseline", part=part, size=size, before=item["baseline"])
