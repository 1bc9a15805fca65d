"""Messages of the Events of a Table's monitoring."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Event
from livebode.core import moment as clock_moment
from livebode.language import Message
from livebode.monitoring.change_date import ChangeDate
from livebode.monitoring.monitored_time import with_more
from livebode.monitoring.table import ALL, ORDERS, STILL, ScheduleTable

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


def cleared(table: ScheduleTable, sample: int, time_s: float) -> Event:
    """All changes have disappeared."""
    message = Message("At {time} {parts} with the baseline again.", time=clock_moment(time_s), parts=_KIND[table.what])
    return Event("change-cleared", sample, time_s, message, {"what": table.what})


def unknown(schedule: float, sample: int, time_s: float) -> Event:
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
    part = name if isinstance(name, Message) else Message(name)
    if item["of"] == "value":
        return Message("{part} {amount:+.1f} ± {bound:.1f} %", part=part, **facts)
    size = Message("{amount:.3g} ± {bound:.2g}", **facts)
    if item["unit"]:
        size = Message("{amount:.3g} ± {bound:.2g} {unit}", unit=item["unit"], **facts)
    return Message("{part} {size}, {before:.3g} in the baseline", part=part, size=size, before=item["baseline"])
