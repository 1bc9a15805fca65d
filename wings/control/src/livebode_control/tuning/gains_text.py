"""The gains of a controller with the keys of [loop]: as the text of a file, and from its tables."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np

from livebode.core import PID, Cascade, Model, PositionPD
from livebode_control.tuning.feedback_parts import FeedbackParts


def parameter_keys(controller: Model) -> dict[str, str]:
    """The key under [loop] of each parameter of `FeedbackParts`; empty for a feedback that has none.

    >>> parameter_keys(PID(gain=0.2, rate_hz=4000))["gain"]
    'loop.velocity.gain'
    """
    if isinstance(controller, PositionPD):
        return {"gain": "loop.position_pd.velocity_gain", "position_gain": "loop.position_pd.position_gain"}
    if not isinstance(controller, PID | Cascade):
        return {}
    of = {name: f"loop.velocity.{name}" for name in ("gain", "integral_time_s", "derivative_time_s")}
    return of | {"position_gain": "loop.position.gain"}


def gains_toml(controller: Model) -> str:
    """The gains and times of a proposed controller, in SI units.

    >>> print(gains_toml(PID(gain=0.2, integral_time_s=0.1, rate_hz=4000)))
    # Gains proposed by livebode tune. Nothing is written to a machine.
    <BLANKLINE>
    [loop.velocity]
    gain = 0.2
    integral_time_s = 0.1
    <BLANKLINE>
    """
    values = FeedbackParts.of(controller, np.ones(1)).values
    lines, table = ["# Gains proposed by livebode tune. Nothing is written to a machine."], ""
    for name, key in parameter_keys(controller).items():
        if name not in values:
            continue
        inside, _, word = key.rpartition(".")
        if inside != table:
            lines += ["", f"[{inside}]"]
            table = inside
        lines.append(f"{word} = {float(values[name])!r}")
    return "\n".join([*lines, ""])


def gains_in(tables: Mapping[str, Any], controller: Model) -> dict[str, float] | None:
    """Values of the parameters of a controller in the parsed file; None if it is not one of `gains_toml` for it.

    >>> pid = PID(gain=0.2, rate_hz=4000)
    >>> gains_in({"loop": {"velocity": {"gain": 0.3}}}, pid), gains_in({}, pid)
    ({'gain': 0.3}, None)
    """
    keys, gains = parameter_keys(controller), {}
    for name, described in FeedbackParts.of(controller, np.ones(1)).values.items():
        value = _at(tables, keys.get(name, ""))
        if not (isinstance(value, int | float) and isfinite(value) and value * described > 0):
            return None
        gains[name] = float(value)
    return gains


def _at(tables: object, key: str) -> object:
    for word in key.split("."):
        tables = tables.get(word) if isinstance(tables, dict) else None
    return tables
