"""Track one recording in a process of its own, so that what it does to its process concerns nobody else.

`python -m livebode_plant.archive.alone FOLDER` is that process: the task is in FOLDER/task, the result in
FOLDER/result.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from livebode.core import ArchiveError, write_whole
from livebode_plant.archive.archived_recordings import (
    ArchivedRecording,
    HashedContent,
    RecordingResults,
    Result,
    TrackingFailure,
    failed,
)
from livebode_plant.archive.tasks import Job, handle_one

_LOOK_S = 0.1
_KILLED_MAX = 3


def handle_alone(job: Job, recording: ArchivedRecording, scratch: Path | None = None) -> RecordingResults:
    """Hash a recording, which ends no process, and find each of its results in a process of its own."""
    started = time.perf_counter()
    hashed = handle_one(job, replace(recording, recipes=()), scratch)
    results: list[Result] = list(hashed.results)
    content = next((result.content for result in results if isinstance(result, HashedContent)), recording.content)
    if not any(isinstance(result, TrackingFailure) for result in results) and not (
        not recording.content and job.knows(content)
    ):
        for recipe in recording.recipes:
            alone = replace(recording, content=content, recipes=(recipe,))
            results += _tracked_alone(job, alone, scratch)
    return RecordingResults(tuple(results), time.perf_counter() - started)


def _tracked_alone(job: Job, recording: ArchivedRecording, scratch: Path | None = None) -> Sequence[Result]:
    """Track a recording of known content by one recipe in a new process; one that needs too much memory is ended.

    SIGKILL comes from outside, from the system or a person, and may have nothing to do with the recording.
    """
    left = _KILLED_MAX
    while True:
        try:
            return _once_alone(job, recording, scratch)
        except ArchiveError as error:
            left -= 1
            if not left or error.facts.get("signal") != "SIGKILL":
                return [failed(recording.place, error, recording.content, *recording.recipes)]


def _once_alone(job: Job, recording: ArchivedRecording, scratch: Path | None) -> Sequence[Result]:
    """The results; ArchiveError if the process ended without them."""
    with tempfile.TemporaryDirectory(prefix="livebode-", dir=scratch) as name:
        folder = Path(name)
        (folder / "task").write_bytes(pickle.dumps((job, recording)))
        with subprocess.Popen(
            [sys.executable, "-m", "livebode_plant.archive.alone", name],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as process:
            try:
                exceeded = _watched(process, job.memory_bytes)
            finally:
                process.kill()
        result = folder / "result"
        if result.exists():
            results: Sequence[Result] = pickle.loads(result.read_bytes())
            return results
    raise _exceeded(job) if exceeded else _ended(process.returncode)


def _watched(process: subprocess.Popen[bytes], memory_bytes: int) -> bool:
    """Wait for the end of a process; whether it was ended because it needs more memory."""
    from psutil import NoSuchProcess, Process  # type: ignore[import-untyped]

    while True:
        try:
            process.wait(_LOOK_S)
            return False
        except subprocess.TimeoutExpired:
            pass
        try:
            if Process(process.pid).memory_info().rss > memory_bytes:
                process.kill()
                return True
        except NoSuchProcess:  # it has just ended
            continue


def _exceeded(job: Job) -> ArchiveError:
    limit_mb = job.memory_bytes // 1_000_000
    return ArchiveError(
        "memory-exceeded",
        f"the recording needs more than {limit_mb} MB of memory",
        "raise cluster.memory_mb, or split the recording",
        limit_mb=limit_mb,
    )


def _ended(code: int) -> ArchiveError:
    ended_by = signal.Signals(-code).name if code < 0 else ""
    how = f"was ended by {ended_by}" if ended_by else f"ended itself with exit code {code}"
    return ArchiveError(
        "process-ended",
        f"the process that tracked the recording {how}",
        "please report it with the recording",
        **({"signal": ended_by} if ended_by else {"exit_code": code}),
    )


def _end_with(parent: int) -> None:
    """End this process when the one that started it has ended."""
    while os.getppid() == parent:
        time.sleep(_LOOK_S)
    os._exit(1)


def _main(folder: Path) -> None:
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    job, recording = pickle.loads((folder / "task").read_bytes())
    write_whole(folder / "result", pickle.dumps(handle_one(job, recording, folder).results))


if __name__ == "__main__":
    _main(Path(sys.argv[1]))
