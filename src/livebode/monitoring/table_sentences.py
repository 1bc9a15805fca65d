"""Messages of the Events of a Table's monitoring."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Event
from livebode.core.clock import moment as clock_moment
from livebode.monitoring.table import ScheduleTable

Floats = NDArray[np.float64]

_NAMED = 4


def differs(table: ScheduleTable, changed: NDArray[np.bool_], amount: Floats, bound: Floats, moment: Floats) -> Event:
    """A change; `moment` is schedule, sample and time of every row since it began."""
    if table.what == "lines":
        amount, bound = _polar(amount, bound)
    items = [_item(table, int(j), float(amount[j]), float(bound[j])) for j in np.flatnonzero(changed)]
    items.sort(key=lambda item: -abs(item["amount"]) / item["bound"])
    named = "; ".join(_phrase(item) for item in items[:_NAMED])
    more = f"; and {len(items) - _NAMED} more" if len(items) > _NAMED else ""
    schedule = moment[:, 0][np.isfinite(moment[:, 0])]
    where = [float(schedule.min()), float(schedule.max())] if schedule.size else None
    place = f", seen from {where[0]:.3g} to {where[1]:.3g}" if where else ""
    details = {
        "what": table.what,
        "changes": items,
        "since_s": float(moment[0, 2]),
        "since_sample": int(moment[0, 1]),
        "seen_at": where,
    }
    message = f"Since {clock_moment(moment[0, 2])} the machine differs from the baseline{place}: {named}{more}."
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
    message = f"At {clock_moment(time_s)} the {_KIND[table.what]} agree with the baseline again."
    return Event("change-cleared", sample, time_s, message, {"what": table.what})


def unknown(schedule: float, sample: int, time_s: float) -> Event:
    """The machine is at a position or moves in a direction that was not learned."""
    message = (
        f"The baseline does not cover {schedule:.4g} in this direction: the machine is not monitored there. "
        "Add a run with such motion and learn again."
    )
    return Event("baseline-unknown", sample, time_s, message, {"reason": "place", "schedule": schedule})


_KIND = {"lines": "responses", "parameters": "parameters"}


def _item(table: ScheduleTable, component: int, amount: float, bound: float) -> dict[str, Any]:
    if table.what == "parameters":
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


def _phrase(item: dict[str, Any]) -> str:
    size = f"{item['amount']:+.1f} ± {item['bound']:.1f} {item['unit']}"
    return f"{item['name']} {size}" if item["of"] == "value" else f"{item['of']} at {item['name']} {size}"
