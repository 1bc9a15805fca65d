"""MatrixHub: the documents of a live matrix run, for each of its entries as those of an ordinary run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.analysis import LIVE_VALUES_MAX, Overview
from livebode.core import MatrixResponses
from livebode.dashboard.hub import Hub
from livebode.records import entry_summary
from livebode.runtime import Document, RunEnded, RunStarted


class MatrixHub:
    """A subscriber that gives each entry to a hub of its own, and retains the newest matrix.

    Parameters
    ----------
    name
        Of the axis.
    entries
        Output and input of each entry.
    """

    def __init__(self, name: str, entries: list[tuple[str, str]]) -> None:
        self.name = name
        self.hubs = {entry: Hub(f"{name} {entry[0]}/{entry[1]}") for entry in entries}
        self._newest: MatrixResponses | None = None

    def newest(self) -> MatrixResponses | None:
        """The newest matrix that has a valid column, one row; None before the first."""
        return self._newest

    def __call__(self, document: Document) -> None:
        if isinstance(document, MatrixResponses):
            self._take(document)
            return
        if isinstance(document, RunStarted):
            self._newest = None
        for entry, hub in self.hubs.items():
            hub(_of_entry(document, entry))

    def _take(self, matrices: MatrixResponses) -> None:
        use = np.flatnonzero(matrices.valid.any(axis=(1, 2)))
        if use.size:
            self._newest = MatrixResponses.join([matrices[use[-1:]]])  # a view would keep all rows in memory
        for entry, hub in self.hubs.items():
            one = matrices.entry(*entry)
            if hub.overview is not None:
                hub.overview.add(one)
            hub(one)


def _of_entry(document: Document, entry: tuple[str, str]) -> Document:
    """The document as that of a run with this entry only."""
    if isinstance(document, RunStarted):
        summary = entry_summary(document.summary, *entry)
        return replace(document, summary=summary, overview=Overview(LIVE_VALUES_MAX))
    if isinstance(document, RunEnded):
        return replace(document, summary=entry_summary(document.summary, *entry))
    return document
