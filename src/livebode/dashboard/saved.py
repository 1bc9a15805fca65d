"""What a person saves with a run from the page: references and annotations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from livebode.core import ServerError
from livebode.dashboard.past import Past
from livebode.dashboard.queries import SavedChange
from livebode.dashboard.state import State
from livebode.records import SavedCurves


def listed(saved: SavedCurves) -> dict[str, Any]:
    """Names and times for the page; the curves themselves are sent as frames."""
    references = [
        {"id": one.id, "name": one.name, "saved": one.saved, "time_s": float(one.response.time_s[0])}
        for one in saved.references
    ]
    return {"references": references, "annotations": [vars(one) for one in saved.annotations]}


def applied(change: SavedChange, past: Past, state: State) -> Callable[[SavedCurves], SavedCurves]:
    """The change as a function; it reads the record, so it is called in another thread."""
    if change.kind == "annotation":
        return lambda saved: saved.with_annotation(change.text, change.at)
    if change.kind == "remove":
        return lambda saved: saved.without(change.text)
    quantities = state.quantities

    def add(saved: SavedCurves) -> SavedCurves:
        response = past.at(change.at)
        if quantities is None or not quantities.fit(response):
            raise ServerError("not-begun", "the response belongs to a previous run", "choose one of this run")
        return saved.with_reference(change.text, response)

    return add
