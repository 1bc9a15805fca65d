"""Messages of the monitoring's Events, for maintenance staff."""

from __future__ import annotations

from math import exp, expm1, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Event
from livebode.core.clock import moment
from livebode.monitoring import evidence as word
from livebode.monitoring.offset import FAR
from livebode.monitoring.sensitivity import DIRECTIONS

if TYPE_CHECKING:
    from livebode.monitoring.alarms import Alarm
    from livebode.monitoring.covariates import Covariates
    from livebode.monitoring.evidence import Evidence
    from livebode.monitoring.machine import LearnedMachine
    from livebode.monitoring.naming import NamedChange

Floats = NDArray[np.float64]

WHAT = {
    "stiffness": "the belt's stiffness",
    "load": "the moved mass",
    "damping": "the belt's damping",
    "inertia": "the motor's inertia",
}


def changed(alarm: Alarm, sample: int, time_s: float, *, within_run: bool = False) -> Event:
    """A change, as known at this sample and time; `within_run`: relative to the earlier part of this run."""
    amount = _amount(alarm.change, alarm.now, alarm.bound)
    message = f"Since {moment(alarm.since_s)} {amount} than {_reference(within_run)}"
    if (rival := alarm.rival) is not None:
        message += f"; a possible alternative: {_amount(rival, rival.amount, rival.bound)}"
    if alarm.change.place is None and abs(alarm.now) > FAR:
        message += ". This is so far from the baseline that it may be another machine; the amount is approximate until "
        message += "all differences are identified"
    return Event("change", sample, time_s, message + ".", about(alarm, within_run=within_run))


def far_away(alarm: Alarm, sample: int, time_s: float) -> Event:
    """A change so large that no single change explains it."""
    message = (
        f"Since {moment(alarm.since_s)} the machine is so far from the baseline that no single change explains it: it "
        "may be another machine. Amounts are reported as soon as the model can follow."
    )
    return Event("change", sample, time_s, message, about_far(alarm))


def about_far(alarm: Alarm) -> dict[str, Any]:
    """The same as plain data: only the time and the range of positions are known."""
    unknown = {"amount_percent": None, "bound_percent": None, "place_m": None, "place_width_m": None}
    return about(alarm) | unknown | {"what": "machine", "may_also_be": None}


def corrected(alarm: Alarm, reported: float, sample: int, time_s: float, *, within_run: bool = False) -> Event:
    """The corrected amount of a reported change, after another change was identified that seemed part of it."""
    message = (
        f"With all changes since then allowed for, {_amount(alarm.change, alarm.now, alarm.bound)} than "
        f"{_reference(within_run)}, not {_size(reported)} as reported earlier."
    )
    details = about(alarm, within_run=within_run) | {"told_percent": percent(reported)}
    return Event("change-corrected", sample, time_s, message, details)


def joint(alarms: list[Alarm]) -> str:
    """The active changes, estimated together, as half a sentence."""
    if not alarms:
        return ""
    return ": " + "; ".join(_amount(alarm.change, alarm.now, alarm.bound) for alarm in alarms)


def cleared(alarm: Alarm, sample: int, time_s: float, *, within_run: bool = False) -> Event:
    """An alarmed change has disappeared."""
    where = _where(alarm.change)
    name = WHAT[DIRECTIONS[alarm.change.direction]]
    message = (
        f"At {moment(time_s)} {name}{where} is as {_reference(within_run)} again; it had changed since "
        f"{moment(alarm.since_s)}."
    )
    return Event("change-cleared", sample, time_s, message, about(alarm, within_run=within_run))


def unknown(machine: LearnedMachine, seen: Evidence, row: int) -> Event:
    """The machine is outside of the learned range in this window."""
    status, position_m, speed_m_per_s = str(seen.status[row]), seen.position_m[row], seen.speed_m_per_s[row]
    details = {"reason": status, "position_m": float(position_m), "speed_m_per_s": float(speed_m_per_s)}
    if status == word.FAST:
        message = (
            f"The baseline covers speeds up to {machine.fastest_m_per_s:.3g} a second, but the axis moves at "
            f"{abs(speed_m_per_s):.3g}: such motion is not monitored. Add a run with such speeds and learn again."
        )
    elif status in (word.COVARIATE, word.NO_COVARIATE):
        message = _not_covered(machine.covariates, seen.covariate[row])
        details |= dict(zip(machine.covariates.names, seen.covariate[row].tolist()))
    else:
        message = (
            f"The baseline does not cover position {position_m:.3g}: the axis is not monitored there. "
            "Add a run with such positions and learn again."
        )
    return Event("baseline-unknown", int(seen.sample[row]), float(seen.time_s[row]), message, details)


def offset_unknown(machine: LearnedMachine, error: float, sample: int, time_s: float) -> Event:
    """The windows of this run do not determine its offset from the baseline; `error` is in smallest changes."""
    between, smallest = machine.between, machine.held.smallest
    assert between is not None
    along = np.flatnonzero(between.dominant(smallest))
    what = " and ".join(WHAT[DIRECTIONS[j]] for j in along)
    size = np.abs(between.direction[along]) * 100
    beyond = ", ".join(f"{3 * between.spread * s:.2g} %" for s in size)
    message = (
        f"The learned runs differ from each other in {what}, and the windows of this run determine its own offset only "
        f"to ± {error * size[0]:.2g} %. Until it is known better, such a change is detected only beyond {beyond} from "
        "the baseline. Use a stronger excitation, or learn with the cause as a covariate."
    )
    details = {"reason": word.OFFSET, "reachable_percent": float(error * size[0])}
    return Event("baseline-unknown", sample, time_s, message, details)


def _not_covered(covariates: Covariates, value: Floats) -> str:
    """The first covariate without a value, or outside of the learned range."""
    for i, name in enumerate(covariates.names):
        if not isfinite(value[i]):
            return f"The covariate {name!r} has no value; the machine is not monitored without it. Check that channel."
    beside = np.maximum(covariates.low - value, value - covariates.high) / covariates.half_range
    i = int(np.argmax(beside))
    return (
        f"The baseline covers {covariates.names[i]!r} from {covariates.low[i]:.4g} to {covariates.high[i]:.4g}, but it "
        f"is {value[i]:.4g}: the machine is not monitored there. Add a run with such values and learn again."
    )


def about(alarm: Alarm, *, within_run: bool = False) -> dict[str, Any]:
    """An alarm as plain data; amounts in percent of the reference: the baseline, or this run before the change."""
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
        "reference": "run" if within_run else "baseline",
    }


def percent(log_amount: float) -> float:
    return 100 * expm1(log_amount)


def bound_percent(log_amount: float, log_bound: float) -> float:
    """Half-width in percent of the baseline."""
    return 100 * log_bound * exp(log_amount)


def _reference(within_run: bool) -> str:
    return "before in this run" if within_run else "in the baseline"


def _amount(change: NamedChange, amount: float, bound: float) -> str:
    within = bound_percent(amount, bound)
    digits = 2 if within < 0.1 else 1
    size = f"{abs(percent(amount)):.{digits}f} ± {within:.{digits}f} %"
    return f"{WHAT[DIRECTIONS[change.direction]]}{_where(change)} is {size} {'less' if amount < 0 else 'more'}"


def _size(amount: float) -> str:
    return f"{abs(percent(amount)):.1f} % {'less' if amount < 0 else 'more'}"


def _where(change: NamedChange) -> str:
    return f" around position {change.place.centre_m:.3g}" if change.place else ""
