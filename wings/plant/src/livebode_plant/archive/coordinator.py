"""The coordinator of an archive: finds what is new, distributes it, and alone commits results to the lake in groups."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import field, replace
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING

import pyarrow as pa
from packaging.version import Version

from livebode.dataclass import dataclass
from livebode.version import __version__
from livebode_plant.archive.alone import handle_alone
from livebode_plant.archive.archive_settings import ArchiveSettings
from livebode_plant.archive.archived_recordings import (
    ArchivedRecording,
    HashedContent,
    RecordingPlace,
    RecordingResults,
    Result,
    TrackedResult,
    TrackingFailure,
    each_result,
    file_rows,
    find_places,
    known_contents,
    levels_of,
    longest_first,
    lost,
    place_of,
    untracked,
)
from livebode_plant.archive.contents import quarantine
from livebode_plant.archive.tasks import Job, handle, short
from livebode_plant.lake import TABLES, DataFile, Lake

if TYPE_CHECKING:
    from livebode_plant.archive.clusters import Cluster


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

    def add(self, results: Iterable[Result]) -> None:
        """Add results, and commit if it is time."""
        self._waiting += results
        if time.monotonic() - self._committed_s > _EVERY_S or len(self._waiting) >= _RESULTS_MAX:
            self.commit()

    def commit(self) -> None:
        """Commit what waits; ArchiveError or LocationError if the lake cannot be written."""
        hashed = [result for result in self._waiting if isinstance(result, HashedContent)]
        tracked = [result for result in self._waiting if isinstance(result, TrackedResult)]
        bad = [result for result in self._waiting if isinstance(result, TrackingFailure) and not result.by_storage]
        if hashed:  # first: what has a result and no known place would be tracked again
            places = [(result.place, result.content) for result in hashed]
            self.lake.add_rows("files", file_rows(places, self.job.common_machine))
        by_table: dict[str, list[DataFile]] = {}
        for result in tracked:
            for file in result.files:
                by_table.setdefault(file.table, []).append(file)
        for table, files in by_table.items():
            self.lake.add_files(table, files)
        for name, rows in (  # a run last: without its row in `runs` a result does not count
            ("quantities", [row for result in tracked for row in result.quantities]),
            ("runs", [result.run for result in tracked]),
            ("quarantine", [self._quarantined(failure) for failure in bad]),
        ):
            if rows:
                self.lake.add_rows(name, pa.Table.from_pylist(rows, TABLES[name].schema))
        self._waiting.clear()
        self._committed_s = time.monotonic()

    def _quarantined(self, one: TrackingFailure) -> dict[str, str | None]:
        return {
            "content": one.content,
            "recipe": one.recipe,
            "url": str(one.place.url),
            "code": one.code,
            "sentence": one.sentence,
            "livebode": __version__,
        } | levels_of(one.place, self.job.machine(one.recipe))


@dataclass(frozen=True)
class Progress:
    """How far an archive is.

    Attributes
    ----------
    stage
        "reading" (hashing what may be a copy) or "tracking".
    done, total
        Recordings.
    done_bytes, total_bytes
        Their lengths.
    dashboard
        Address of Dask's page, if a cluster runs.
    """

    stage: str
    done: int
    total: int
    done_bytes: int
    total_bytes: int
    dashboard: str | None


@dataclass
class ArchiveOutcome:
    """What a run of an archive did.

    Attributes
    ----------
    recordings
        Places that the inputs name.
    known
        Of these, those whose content was in the lake already, as a result or in quarantine, or is at another place.
    tracked
        Results that are in the lake now: one for each recording and axis of the recipe.
    quarantined, unreadable
        Recordings that could not be tracked, and those that could not be read; these are tried again next time.
    stopped
        Whether it was stopped before everything was tracked; `remaining` recordings are left.
    """

    recordings: int = 0
    known: int = 0
    tracked: int = 0
    quarantined: list[TrackingFailure] = field(default_factory=list)
    unreadable: list[TrackingFailure] = field(default_factory=list)
    stopped: bool = False
    remaining: int = 0


Report = Callable[[Progress], None]


class Coordinator:
    """Tracks the recordings of an archive. Several of them may work on one lake at the same time.

    Parameters
    ----------
    settings
        The archive.
    report
        Receives the progress.

    Raises
    ------
    ConfigError
        If the recipe is not usable.
    """

    def __init__(self, settings: ArchiveSettings, report: Report) -> None:
        self._settings, self._report = settings, report
        self._lake = Lake(settings.lake)
        memory_bytes = settings.cluster.memory_mb * 1_000_000
        self._job = Job.of(settings.axes(), settings.lake, memory_bytes, settings.baselines)
        self._outcome = ArchiveOutcome()
        self._cluster: Cluster | None = None

    def run(self) -> ArchiveOutcome:
        """Track what the lake does not have; Ctrl-C and SIGTERM end it with the results of what was finished.

        Raises
        ------
        LivebodeError
            If no recording is found, or the storage, the lake or the cluster cannot be used.
        """
        outcome = self._outcome
        self._lake.check()
        places = find_places(self._settings.templates)
        outcome.recordings = len(places)
        with self._until_stopped() as stack:
            recordings = self._recordings(places, stack)
            outcome.known = len(places) - len(recordings) - len(outcome.unreadable)
            self._handle("tracking", recordings, stack)
        return outcome

    def retry(self, older: bool) -> ArchiveOutcome:
        """Track what is in quarantine for this recipe again, each alone; with `older` what another livebode tried."""
        rows = [row for row in quarantine(self._lake) if row["recipe"] in self._job.recipes]
        if older:
            rows = [row for row in rows if Version(row["livebode"]) < Version(__version__)]
        self._outcome.recordings = len(rows)
        recordings = [ArchivedRecording(place_of(row), (row["recipe"],), row["content"]) for row in rows]
        with self._until_stopped() as stack:
            self._handle("tracking", recordings, stack, alone=True)
        return self._outcome

    @contextmanager
    def _until_stopped(self) -> Iterator[ExitStack]:
        """The context of the cluster; Ctrl-C and SIGTERM end it."""
        with ExitStack() as stack:
            try:
                yield stack
            except (KeyboardInterrupt, SystemExit):
                self._outcome.stopped = True

    def _recordings(self, places: Sequence[RecordingPlace], stack: ExitStack) -> list[ArchivedRecording]:
        """What is to be tracked, the longest first: contents without a result, and places whose content is not known.

        Only recordings of one length can have one content, so only those are hashed before any of them is tracked.
        """
        known, by_size = known_contents(self._lake)
        skipped = {*self._lake.keys("runs"), *(key[:2] for key in self._lake.keys("quarantine"))}
        recipes = tuple(self._job.recipes)

        def waiting() -> list[ArchivedRecording]:
            contents = [(place, known[place.known_as]) for place in places if place.known_as in known]
            return untracked(contents, recipes, skipped)

        new = [place for place in places if place.known_as not in known]
        lengths = Counter(place.size_bytes for place in (*new, *(recording.place for recording in waiting())))
        alike = [place for place in new if not place.size_bytes or lengths[place.size_bytes] > 1]
        for result in self._handle("reading", [ArchivedRecording(place) for place in alike], stack):
            if isinstance(result, HashedContent):
                known[result.place.known_as] = result.content
        single = [ArchivedRecording(place, recipes) for place in new if lengths[place.size_bytes] == 1]
        candidates = {content for recording in single for content in by_size.get(recording.size_bytes, ())}
        done = {content for content in candidates if all((content, recipe) in skipped for recipe in recipes)}
        self._job = replace(self._job, known=frozenset(map(short, done)))
        return longest_first([*waiting(), *single])

    def _handle(
        self, stage: str, recordings: Sequence[ArchivedRecording], stack: ExitStack, alone: bool = False
    ) -> list[Result]:
        """Hash or track recordings, and commit what is found."""
        if not recordings:
            return []
        committer, results = Committer(self._lake, self._job), []
        tracking = stage == "tracking"
        self._outcome.remaining = len(recordings) if tracking else 0
        try:
            for handled in self._distributed(stage, recordings, stack, alone):
                new = each_result(handled)
                self._count(new)
                if tracking:
                    self._outcome.remaining -= len(handled)
                    self._outcome.known += sum(
                        all(isinstance(result, HashedContent) for result in recording.results) for recording in handled
                    )
                results += [] if tracking else new
                committer.add(new)
        finally:
            committer.commit()
        return results

    def _count(self, results: Iterable[Result]) -> None:
        for result in results:
            if isinstance(result, TrackedResult):
                self._outcome.tracked += 1
            elif isinstance(result, TrackingFailure):
                bad = self._outcome.unreadable if result.by_storage else self._outcome.quarantined
                bad.append(result)

    def _distributed(
        self, stage: str, recordings: Sequence[ArchivedRecording], stack: ExitStack, alone: bool
    ) -> Iterator[list[RecordingResults]]:
        """What was found, in the order in which it comes."""
        cluster = self._started(stack)
        from livebode_plant.archive.distribution import Distribution, RecordingGroups

        groups = RecordingGroups([] if alone else recordings)
        together, alone_task = partial(handle, self._job), partial(handle_alone, self._job)
        work: Distribution[ArchivedRecording, RecordingResults] = Distribution(
            cluster, groups, together, alone_task, attrgetter("again"), lost
        )
        work.last.extend(recordings if alone else ())
        done, done_bytes, total_bytes = 0, 0, sum(recording.size_bytes for recording in recordings)
        self._report(Progress(stage, 0, len(recordings), 0, total_bytes, cluster.dashboard))
        try:
            for pairs in work.results():
                for recording, handled in pairs:
                    groups.learn(recording.size_bytes, handled.seconds)
                    done, done_bytes = done + 1, done_bytes + recording.size_bytes
                self._report(Progress(stage, done, len(recordings), done_bytes, total_bytes, cluster.dashboard))
                yield [handled for _, handled in pairs]
        except (KeyboardInterrupt, SystemExit):
            yield [handled for _, handled in work.ready()]
            raise

    def _started(self, stack: ExitStack) -> Cluster:
        """The cluster, which is started when there is something to do."""
        if self._cluster is None:
            from livebode_plant.archive.clusters import started

            self._cluster = stack.enter_context(started(self._settings.cluster))
        return self._cluster
