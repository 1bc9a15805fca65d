"""The process in which a recording is tracked alone, killed from outside while it works."""

from __future__ import annotations

import threading
from pathlib import Path

import psutil
import pytest

from livebode_plant.archive.alone import handle_alone
from livebode_plant.archive.archive_settings import ArchiveSettings
from livebode_plant.archive.archived_recordings import TrackedResult, TrackingFailure, find_places, untracked
from livebode_plant.archive.tasks import Job
from tests.support.archives import contents_of, write_archive


@pytest.mark.parametrize(("kills", "kind"), [(2, TrackedResult), (3, TrackingFailure)])
def test_a_process_that_is_killed_is_started_again_twice(tmp_path: Path, kills: int, kind: type) -> None:
    settings = ArchiveSettings.read(write_archive(tmp_path, 1))
    job = Job.of(settings.axes(), str(tmp_path / "lake"), 10**12)
    contents = contents_of(job, find_places(settings.templates))
    (recording,) = untracked(contents, job.recipes, set())
    killer = threading.Thread(target=_kill, args=(kills,))
    killer.start()
    (result,) = handle_alone(job, recording).results
    killer.join()
    assert type(result) is kind
    if isinstance(result, TrackingFailure):
        assert result.code == "archive.process-ended"
        assert "ended by SIGKILL" in result.sentence


def _kill(count: int) -> None:
    """Kill as many processes that track alone, one after the other."""
    killed: set[int] = set()
    while len(killed) < count:
        for child in psutil.Process().children():
            try:
                if child.pid not in killed and "livebode_plant.archive.alone" in child.cmdline():
                    child.kill()
                    killed.add(child.pid)
            except psutil.NoSuchProcess:
                continue
