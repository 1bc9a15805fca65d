"""The coordinator of an archive: finds what is new, distributes it, and alone commits results to the lake."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from packaging.version import Version

from livebode.archive.alone import track_alone
from livebode.archive.committing import Committer
from livebode.archive.contents import quarantine
from livebode.archive.grouping import RecordingGroups
from livebode.archive.recordings import (
    ArchivedRecording,
    RecordingPlace,
    file_rows,
    find_places,
    known_contents,
    place_of,
    untracked,
)
from livebode.archive.results import Failed, Hashed, Result, Tracked
from livebode.archive.settings import ArchiveSettings
from livebode.archive.tasks import hash_places, track_recordings
from livebode.archive.tracking import Job
from livebode.configuration.recipe import recipe_id
from livebode.lake import Lake
from livebode.version import __version__

if TYPE_CHECKING:
    from livebode.archive.clusters import Cluster

_HASHED_MAX = 1000


@dataclass(frozen=True)
class Progress:
    """How far an archive is.

    Attributes
    ----------
    stage
        "reading" (hashing what is new) or "tracking".
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
        Results that are in the lake now.
    quarantined, unreadable
        Recordings that could not be tracked, and those that could not be read; these are tried again next time.
    stopped
        Whether it was stopped before everything was tracked; `remaining` recordings are left.
    """

    recordings: int = 0
    known: int = 0
    tracked: int = 0
    quarantined: list[Failed] = field(default_factory=list)
    unreadable: list[Failed] = field(default_factory=list)
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
        axis = settings.axis()
        self._settings, self._report = settings, report
        self._lake = Lake(settings.lake)
        self._job = Job(
            axis, recipe_id(axis), settings.lake, settings.cluster.memory_mb * 1_000_000, settings.baselines
        )
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
        places = find_places(self._settings.templates)
        outcome.recordings = len(places)
        with ExitStack() as stack:
            try:
                contents = self._contents(places, stack)
                skipped = {*self._lake.keys("runs"), *(key[:2] for key in self._lake.keys("quarantine"))}
                recordings = untracked(contents, self._job.recipe, skipped)
                outcome.known = len(places) - len(recordings) - len(outcome.unreadable)
                self._track(recordings, stack)
            except (KeyboardInterrupt, SystemExit):
                outcome.stopped = True
        return outcome

    def retry(self, older: bool) -> ArchiveOutcome:
        """Track what is in quarantine for this recipe again, each alone; with `older` what another livebode tried."""
        rows = [row for row in quarantine(self._lake) if row["recipe"] == self._job.recipe]
        if older:
            rows = [row for row in rows if Version(row["livebode"]) < Version(__version__)]
        self._outcome.recordings = len(rows)
        with ExitStack() as stack:
            try:
                self._track([ArchivedRecording(row["content"], place_of(row)) for row in rows], stack, alone=True)
            except (KeyboardInterrupt, SystemExit):
                self._outcome.stopped = True
        return self._outcome

    def _contents(self, places: Sequence[RecordingPlace], stack: ExitStack) -> list[tuple[RecordingPlace, str]]:
        """The content at each place; what the lake does not know is hashed, and committed to `files`."""
        known = known_contents(self._lake)
        new = [place for place in places if place.known_as not in known]
        waiting: list[tuple[RecordingPlace, str]] = []

        def commit() -> None:
            if waiting:
                self._lake.add_rows("files", file_rows(waiting, self._job.machine))
                known.update({place.known_as: content for place, content in waiting})
                waiting.clear()

        for results in self._distributed("reading", new, hash_places, _hash_alone, stack) if new else ():
            for result in results:
                if isinstance(result, Hashed):
                    waiting.append((result.item, result.content))
                elif isinstance(result, Failed):
                    self._outcome.unreadable.append(result)
            if len(waiting) >= _HASHED_MAX:
                commit()
        commit()
        return [(place, known[place.known_as]) for place in places if place.known_as in known]

    def _track(self, recordings: Sequence[ArchivedRecording], stack: ExitStack, alone: bool = False) -> None:
        if not recordings:
            return
        committer = Committer(self._lake, self._job.recipe, self._job.machine)
        self._outcome.remaining = len(recordings)
        together, one = partial(track_recordings, self._job), partial(track_alone, self._job)
        try:
            for results in self._distributed("tracking", recordings, together, one, stack, alone):
                self._count(results)
                committer.take(results)
        finally:
            committer.commit()

    def _count(self, results: Iterable[Result]) -> None:
        for result in results:
            self._outcome.remaining -= 1
            if isinstance(result, Tracked):
                self._outcome.tracked += 1
            elif isinstance(result, Failed):
                bad = self._outcome.unreadable if result.by_storage else self._outcome.quarantined
                bad.append(result)

    def _distributed(
        self, stage: str, items: Sequence[Any], together: Any, one: Any, stack: ExitStack, alone: bool = False
    ) -> Iterator[list[Any]]:
        """The results of items, in the order in which they come."""
        cluster = self._started(stack)
        from livebode.archive.distributing import Distribution

        groups: RecordingGroups[Any] = RecordingGroups([] if alone else items)
        work: Distribution[Any, Any] = Distribution(cluster, groups, together, one, _again)
        work.last.extend(items if alone else ())
        done, done_bytes, total_bytes = 0, 0, sum(item.size_bytes for item in items)
        self._report(Progress(stage, 0, len(items), 0, total_bytes, cluster.dashboard))
        try:
            for pairs in work.results():
                for item, result in pairs:
                    groups.learn(item.size_bytes, result.seconds)
                    done, done_bytes = done + 1, done_bytes + item.size_bytes
                self._report(Progress(stage, done, len(items), done_bytes, total_bytes, cluster.dashboard))
                yield [result for _, result in pairs]
        except (KeyboardInterrupt, SystemExit):
            yield [result for _, result in work.ready()]
            raise

    def _started(self, stack: ExitStack) -> Cluster:
        """The cluster, which is started when there is something to do."""
        if self._cluster is None:
            from livebode.archive.clusters import started

            self._cluster = stack.enter_context(started(self._settings.cluster))
        return self._cluster


def _again(result: Result) -> bool:
    """Whether to try again alone: what the content is the reason of has the same result each time."""
    return isinstance(result, Failed) and not result.by_content


def _hash_alone(place: RecordingPlace, scratch: Path | None = None) -> Hashed | Failed:  # noqa: ARG001
    """Hash once more: hashing ends no process, but a storage may fail for a moment."""
    return hash_places([place])[0]
