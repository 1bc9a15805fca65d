"""Responses that wait for their chunk."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.core import PER_LINE, PER_RESPONSE, Lines, Responses, Stage, StatefulBase

_ARRAYS = PER_LINE + PER_RESPONSE


class PendingResponses(StatefulBase):
    """The Tracker's responses from the newest chunk on."""

    _stage = Stage("waiting-responses", 1)

    def __init__(self, lines: Lines) -> None:
        self._lines = lines
        self._parts: list[Responses] = []

    def append(self, responses: Responses) -> None:
        self._parts.append(responses)

    def take(self, stop: int) -> Responses:
        """Remove and return those whose newest sample is before `stop`."""
        whole = Responses.join(self._parts)
        count = int(np.searchsorted(whole.sample, stop))
        # Joining copies, so that the removed responses do not remain in memory behind a view.
        self._parts = [Responses.join([whole[count:]])]
        return whole[:count]

    def _state(self) -> dict[str, Any]:
        if not self._parts:
            return {"unit": None}
        whole = Responses.join(self._parts)
        return {name: getattr(whole, name) for name in _ARRAYS} | {"unit": whole.unit}

    def _load(self, state: dict[str, Any]) -> None:
        arrays = {name: array for name, array in state.items() if name != "unit"}
        self._parts = [Responses(lines=self._lines, unit=state["unit"], **arrays)] if arrays else []
