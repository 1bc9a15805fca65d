"""Gains and filters of the newest `livebode tune` of a run, as the page sets them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from livebode.core import PID, LivebodeError, Model, PositionPD
from livebode_control.proposal.stored_proposal import stored_proposal
from livebode_control.tuning.gains_text import gains_in


def proposed_controller(directory: Path, controller: Model, entry: str | None = None) -> dict[str, Any] | None:
    """Gains, notches and low-passes from tune.json; None if it is missing, damaged, or of another entry.

    The gains are None if they are those of another controller than the described one.
    """
    try:
        stored = stored_proposal(directory)
    except LivebodeError:
        return None
    if stored is None or stored.entry != entry:
        return None
    gains = gains_in({"loop": _tables(stored.controller, controller)}, controller)
    notches = [{"hz": one.frequency_hz, "depth_db": one.depth_db, "damping": one.damping} for one in stored.notches]
    nothing = gains is None and not notches and not stored.low_passes_hz
    return None if nothing else {"gains": gains, "notches": notches, "low_passes_hz": stored.low_passes_hz}


def _tables(values: Mapping[str, Any], controller: Model) -> Mapping[str, Any]:
    """The values of a controller as the tables of [loop]."""
    if isinstance(controller, PID):
        return {"velocity": values}
    return {"position_pd": values} if isinstance(controller, PositionPD) else values
