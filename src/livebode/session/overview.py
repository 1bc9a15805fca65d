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
        self._keep(responses[-self._seen % self._stride :: self._stride])
        self._seen += len(responses)
        while self._kept > _ROWS_MAX:
            whole = self.responses()
            self._parts, self._kept = [], 0
            self._keep(whole[::2])
            self._stride *= 2

    def _keep(self, responses: Responses) -> None:
        # Joining copies, so that the rows that are not kept do not stay in memory behind views.
        self._parts.append(Responses.join([responses]))
        self._kept += len(responses)

    def responses(self) -> Responses:
        """What was kept."""
        return Responses.join(self._parts)
