"""Commit results to a lake in groups; the row in `runs` is the last, so a result counts completely or not at all."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field

import pyarrow as pa

from livebode.version import __version__
from livebode_plant.archive.job import Job
from livebode_plant.archive.recordings import file_rows, levels_of
from livebode_plant.archive.results import Failed, Hashed, Result, Tracked
from livebode_plant.lake import QUANTITIES, QUARANTINE, RUNS, DataFile, Lake

_EVERY_S = 2.0
_RESULTS_MAX = 500


@dataclass
class Committer:
    """Collects results, and commits them some seconds later together: a commit takes as long as reading a short file.

    Attributes
    ----------
    lake
        Where to.
    job
        What the results are of.
    """

    lake: Lake
    job: Job
    _waiting: list[Result] = field(default_factory=list)
    _committed_s: float = field(default_factory=time.monotonic)

    def take(self, results: Iterable[Result]) -> None:
        """Take results, and commit if it is time."""
        self._waiting += results
        if time.monotonic() - self._committed_s > _EVERY_S or len(self._waiting) >= _RESULTS_MAX:
            self.commit()

    def commit(self) -> None:
        """Commit what waits; ArchiveError or LocationError if the lake cannot be written."""
        hashed = [one for one in self._waiting if isinstance(one, Hashed)]
        tracked = [one for one in self._waiting if isinstance(one, Tracked)]
        bad = [one for one in self._waiting if isinstance(one, Failed) and not one.by_storage]
        if hashed:  # first: what has a result and no known place would be tracked again
            rows = file_rows([(one.place, one.content) for one in hashed], self.job.common_machine)
            self.lake.add_rows("files", rows)
        by_table: dict[str, list[DataFile]] = {}
        for one in tracked:
            for file in one.files:
                by_table.setdefault(file.table, []).append(file)
        for table, files in by_table.items():
            self.lake.add_files(table, files)
        quantities = [row for one in tracked for row in one.quantities]
        for name, found, schema in (
            ("quantities", quantities, QUANTITIES),
            ("runs", [one.run for one in tracked], RUNS),
            ("quarantine", [self._quarantined(one) for one in bad], QUARANTINE),
        ):
            if found:
                self.lake.add_rows(name, pa.Table.from_pylist(found, schema=schema))
        self._waiting.clear()
        self._committed_s = time.monotonic()

    def _quarantined(self, one: Failed) -> dict[str, str | None]:
        return {
            "content": one.content,
            "recipe": one.recipe,
            "url": str(one.place.url),
            "code": one.code,
            "sentence": one.sentence,
            "livebode": __version__,
        } | levels_of(one.place, self.job.machine(one.recipe))
