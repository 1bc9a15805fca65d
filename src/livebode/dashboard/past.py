"""The past of a run: responses of a span of time or at a time, from the record or from memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from livebode.analysis import Overview
from livebode.core import Responses, ServerError
from livebode.dashboard.state import State
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.records import RunRecord, thinned

ROWS_MAX = 2000
_READ_BYTES = 8 << 20  # longer spans are shown from the thinned copy in memory
_WHOLE = 0.95  # of the run: for longer spans the thinned copy in memory is equivalent


@dataclass(frozen=True)
class Past:
    """A copy of the data of the server's thread, for queries in another thread.

    Attributes
    ----------
    directory
        Run directory.
    recent, overview
        The newest responses, and every n-th of the whole run; None before the first.
    first_s, last_s
        Times of the start of the run and of its newest response.
    shown
        The newest responses that were sent to browsers.
    readable
        Whether the record can be read: one without a journal can be read only after its end.
    entry
        Of a matrix run: output and input of the responses, such as "velocity2/u1".
    """

    directory: Path
    recent: Responses | None
    overview: Responses | None
    first_s: float
    last_s: float
    readable: bool
    shown: tuple[Responses, ...]
    entry: str | None = None

    @classmethod
    def of(cls, state: State) -> Past:
        """Copy the data of an axis; called in the server's thread."""
        assert state.directory is not None
        overview = None if state.newest is None else state.overview.responses()
        return cls(
            state.directory,
            state.recent.all(),
            overview,
            state.first_s,
            state.last_s,
            state.readable,
            tuple(state.sent),
            state.entry,
        )

    def between(self, from_s: float, to_s: float, rows: int) -> Responses:
        """Every n-th response of a span, at most `rows`, or means; ServerError before the first response.

        Means are used where the record has them, for spans with very many responses.
        """
        if self.overview is None:
            raise ServerError("not-begun", Message("there is no response yet"), Message("wait for the first window"))
        rows = max(1, min(rows, ROWS_MAX))
        within = self.overview.between(from_s, to_s)
        if (to_s - from_s) >= _WHOLE * (self.last_s - self.first_s):
            return _thinned(within, rows)
        newest = within[0:0]
        if self.recent is not None and len(self.recent):
            newest = self.recent.between(from_s, to_s)
            # It has at most 20 responses per second: a short span has more of them in the record.
            if from_s >= self.recent.time_s[0] and (len(newest) >= rows or not self.readable):
                return _thinned(newest, rows)
        if not self.readable:
            return _thinned(within, rows)
        recorded = self._recorded(from_s, to_s, rows)
        if recorded is None:
            return _thinned(newest if len(newest) else within, rows)
        behind = newest[np.flatnonzero(newest.sample > recorded.sample[-1])]  # of a segment that is being written
        return _thinned(Responses.join([recorded, replace(behind, unit=recorded.unit)]), rows)

    def record(self) -> RunRecord:
        """The record of the run, or of its entry."""
        return RunRecord.open(self.directory, entry=self.entry)

    def _recorded(self, from_s: float, to_s: float, rows: int) -> Responses | None:
        run = self.record()
        within = [
            segment for segment in run.segments if segment.table == "responses" and from_s <= segment.last_s <= to_s
        ]
        if sum(segment.size_bytes for segment in within) > _READ_BYTES:
            means = thinned(run, (to_s - from_s) / max(1, rows - 1), (from_s, to_s))
            if means is not None:
                return means
        overview, number = Overview(), 0
        for part in run.between(from_s, to_s):
            overview.add(part)
            number += len(part)
        return overview.responses() if number else None

    def all_between(self, from_s: float, to_s: float) -> Iterator[Responses]:
        """All responses of a span, in parts: from the record if it can be read, otherwise those in memory."""
        if self.readable:
            yield from self.record().between(from_s, to_s)
        elif self.recent is None or self.overview is None:
            raise ServerError("not-begun", Message("there is no response yet"), Message("wait for the first window"))
        else:
            yield (self.recent if from_s >= self.recent.time_s[0] else self.overview).between(from_s, to_s)

    def at(self, time_s: float) -> Responses:
        """The response with a valid line nearest to a time, one row, from the most exact source."""
        parts = [part for part in (*self.shown, self.recent, self.overview) if part is not None]
        if self.readable and self.overview is not None:
            reach_s = 2 * self.overview.lines.window / self.overview.lines.rate_hz
            parts += self.record().between(time_s - reach_s, time_s + reach_s)
        best = _nearest(parts, time_s)
        if best is None:
            raise ServerError(
                "not-begun", Message("no response has a valid line yet"), Message("wait for the first window")
            )
        return best


def _thinned(responses: Responses, rows: int) -> Responses:
    return responses[:: max(1, -(-len(responses) // rows))]


def _nearest(parts: list[Responses], time_s: float) -> Responses | None:
    candidates: list[Responses] = []
    for part in parts:
        use = np.flatnonzero(part.valid.any(axis=1))
        if use.size:
            row = int(use[np.argmin(np.abs(part.time_s[use] - time_s))])
            candidates.append(part[row : row + 1])
    return min(candidates, key=lambda candidate: abs(float(candidate.time_s[0]) - time_s), default=None)
