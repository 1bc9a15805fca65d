"""A run in few rows, for pictures: memory stays bounded however long the run is."""

from __future__ import annotations

from livebode.nouns import Responses

_ROWS_MAX = 2048


class Overview:
    """Keeps every n-th response, evenly over the run, with n doubled whenever there are too many."""

    def __init__(self) -> None:
        self._parts: list[Responses] = []
        self._stride = 1
        self._seen = 0
        self._kept = 0

    def add(self, responses: Responses) -> None:
        kept = responses[-self._seen % self._stride :: self._stride]
        self._seen += len(responses)
        self._parts.append(kept)
        self._kept += len(kept)
        while self._kept > _ROWS_MAX:
            whole = Responses.join(self._parts)[::2]
            # A copy, so that the rows that are no longer kept do not stay in memory.
            self._parts = [Responses.join([whole])]
            self._kept = len(whole)
            self._stride *= 2

    def responses(self) -> Responses:
        """What was kept."""
        return Responses.join(self._parts)
