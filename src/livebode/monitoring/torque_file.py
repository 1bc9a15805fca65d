"""Friction and orders of a baseline in its file."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.core import LivebodeError
from livebode.monitoring.baseline_part import BaselinePart
from livebode.monitoring.learned_torque import LearnedTorque
from livebode.monitoring.order_amplitudes import TorqueNoise
from livebode.monitoring.table_file import as_list, table_of, table_plain
from livebode.monitoring.torque_model import TorqueModel
from livebode.motion import Shaft

_ARRAYS = "speed", "friction", "lines_hz"
_NOISE = "frequency_hz", "power"
_NUMBERS = "inertia", "offset", "turn"


def torque_plain(learned: LearnedTorque) -> dict[str, Any]:
    """As plain data, for JSON."""
    model = learned.model
    return {
        "kind": model.kind,
        **{name: getattr(model, name) for name in _NUMBERS},
        **{name: as_list(getattr(model, name)) for name in _ARRAYS},
        "shafts": [{"name": one.name, "turns": one.turns, "orders": list(one.orders)} for one in model.shafts],
        "middle": learned.middle,
        "noise": None if learned.noise is None else {n: as_list(getattr(learned.noise, n)) for n in _NOISE},
        "true": as_list(learned.true),
        "usual": as_list(learned.usual),
        "tables": [table_plain(table) for table in learned.tables],
    }


def torque_of(data: BaselinePart) -> LearnedTorque:
    """From plain data; BaselineError where it is damaged."""
    kind = data.text("kind")
    if kind not in ("position", "velocity"):
        raise data.wrong("kind", "neither position nor velocity")
    arrays = {name: data.array(name, 1) for name in _ARRAYS}
    if arrays["speed"].size != arrays["friction"].size or arrays["speed"].size < 2:
        raise data.wrong("friction", "not as long as speed, or shorter than 2")
    shafts = tuple(_shaft(part) for part in data.parts("shafts"))
    tables = [table_of(part) for part in data.parts("tables")]
    orders = tables[1] if len(tables) > 1 else None
    each = {name: data.array(name, 1, least=0, known=False) for name in ("true", "usual")}
    count = sum(len(one.orders) for one in shafts) if orders is not None else 0
    for name, values in each.items():
        if values.size != count:
            raise data.wrong(name, f"not {count} numbers")
    return LearnedTorque(
        TorqueModel(
            "position" if kind == "position" else "velocity",
            inertia=data.number("inertia"),
            offset=data.number("offset"),
            turn=data.number("turn"),
            shafts=shafts,
            speed=arrays["speed"],
            friction=arrays["friction"],
            lines_hz=arrays["lines_hz"],
        ),
        data.number("middle"),
        None if orders is None else _noise(data.part("noise")),
        each["true"],
        np.where(np.isnan(each["usual"]), np.inf, each["usual"]),
        tables[0],
        orders,
    )


def _noise(data: BaselinePart) -> TorqueNoise:
    frequency_hz, power = (data.array(name, 1, least=0) for name in _NOISE)
    if frequency_hz.size != power.size or not power.size or not power.all():
        raise data.wrong("power", "not a positive number for each frequency")
    return TorqueNoise(frequency_hz, power)


def _shaft(data: BaselinePart) -> Shaft:
    orders = tuple(int(order) for order in data.array("orders", 1, least=1))
    try:
        return Shaft(data.text("name"), data.number("turns", 0), orders)
    except LivebodeError as error:
        raise data.wrong("orders", f"not those of a shaft ({error.message})") from None
