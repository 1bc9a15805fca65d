"""Commit results to a lake in groups; the row in `runs` is the last, so a result counts completely or not at all."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field

import pyarrow as pa

from livebode.archive.recordings import ArchivedRecording, levels_of
from livebode.archive.results import Failed, Tracked
from livebode.lake import QUANTITIES, QUARANTINE, RUNS, DataFile, Lake
from livebode.version import __version__

_EVERY_S = 2.0
_RESULTS_MAX = 500


@dataclass
class Committer:
    """Collects results, and commits them some seconds later together: a commit takes as long as reading a short file.

    Attributes
    ----------
    lake
        Where to.
    recipe
        Id of the recipe.
    machine
        Levels of the machine for recordings whose place names none.
    """

    lake: Lake
    recipe: str
    machine: dict[str, str]
    _waiting: list[Tracked | Failed] = field(default_factory=list)
    _committed_s: float = field(default_factory=time.monotonic)

    def take(self, results: Iterable[Tracked | Failed]) -> None:
        """Take results, and commit if it is time."""
        self._waiting += results
        if time.monotonic() - self._committed_s > _EVERY_S or len(self._waiting) >= _RESULTS_MAX:
            self.commit()

    def commit(self) -> None:
        """Commit what waits; ArchiveError or LocationError if the lake cannot be written."""
        tracked = [one for one in self._waiting if isinstance(one, Tracked)]
        bad = [one for one in self._waiting if isinstance(one, Failed) and not one.by_storage]
        by_table: dict[str, list[DataFile]] = {"responses": [], "parameters": [], "events": []}
        for one in tracked:
            for file in one.files:
                by_table[file.table].append(file)
        for table, files in by_table.items():
            self.lake.add_files(table, files)
        quantities = [row for one in tracked for row in one.quantities]
        for name, rows, schema in (
            ("quantities", quantities, QUANTITIES),
            ("runs", [one.run for one in tracked], RUNS),
            ("quarantine", [self._quarantined(one) for one in bad], QUARANTINE),
        ):
            if rows:
                self.lake.add_rows(name, pa.Table.from_pylist(rows, schema=schema))
        self._waiting.clear()
        self._committed_s = time.monotonic()

    def _quarantined(self, one: Failed) -> dict[str, str | None]:
        assert isinstance(one.item, ArchivedRecording)
        place = one.item.place
        return {
            "content": one.item.content,
            "recipe": self.recipe,
            "url": str(place.url),
            "code": one.code,
            "sentence": one.sentence,
            "livebode": __version__,
        } | levels_of(place, self.machine)
