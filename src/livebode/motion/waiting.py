"""Responses that wait for their chunk."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import PER_LINE, PER_RESPONSE, Lines, Responses

_ARRAYS = PER_LINE + PER_RESPONSE


class Waiting:
    """The Tracker's responses from the newest chunk on."""

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

    def state(self) -> dict[str, NDArray[np.generic]]:
        if not self._parts:
            return {}
        whole = Responses.join(self._parts)
        return {name: getattr(whole, name) for name in _ARRAYS} | {"unit": np.array([whole.unit])}

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        arrays: dict[str, Any] = {name: np.array(state[name]) for name in _ARRAYS if name in state}
        self._parts = [Responses(lines=self._lines, unit=str(state["unit"][0]), **arrays)] if arrays else []
