"""A file is whole or as it was before, whatever goes wrong while it is written."""

from __future__ import annotations

import errno
import os
import resource
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from livebode.core import (
    LivebodeError,
    OutputError,
    RecordError,
    whole_directory,
    whole_file,
    whole_files,
    write_whole,
    writing,
)
from tests.support.errors import refused

OLD, NEW = b"old" * 100, b"new" * 100_000
CALLS = ("open", "write", "fsync", "replace", "mkdir", "chmod", "rename")


def by_path(place: Path) -> None:
    with whole_file(place / "a.json") as partial:
        partial.write_bytes(NEW)


def by_content(place: Path) -> None:
    write_whole(place / "a.json", NEW)


def locked(place: Path) -> None:
    write_whole(place / "a.json", NEW, locked=True)


def one_of_several(place: Path) -> None:
    with whole_files(place, "parts") as partial:
        (partial / "a.json").write_bytes(NEW)


def directory(place: Path) -> None:
    with whole_directory(place, shutil.rmtree) as partial:
        (partial / "a.json").write_bytes(NEW)


WRITERS = (by_path, by_content, locked, one_of_several, directory)
every_writer = pytest.mark.parametrize("write", WRITERS)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    place = tmp_path / "place"
    place.mkdir()
    (place / "a.json").write_bytes(OLD)
    return place


def contents(folder: Path) -> dict[str, bytes]:
    """Content of every file below the folder; a directory has none."""
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else b"" for p in sorted(folder.rglob("*"))}


BEFORE, AFTER = ({"place": b"", "place/a.json": content} for content in (OLD, NEW))


@contextmanager
def failing(at: int) -> Iterator[list[str]]:
    """Let the `at`-th call that changes a file fail; the names of all calls."""
    seen: list[str] = []

    def around(name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def called(*args: Any, **kwargs: Any) -> Any:
            seen.append(name)
            if len(seen) == at:
                raise OSError(errno.ENOSPC, "No space left on device")
            return call(*args, **kwargs)

        return called

    with pytest.MonkeyPatch.context() as patch:
        for name in CALLS:
            patch.setattr(os, name, around(name, getattr(os, name)))
        yield seen


@every_writer
def test_whichever_call_fails_the_file_is_old_or_new_and_nothing_else_remains(write, tmp_path: Path) -> None:
    for at in range(1, 50):
        place = tmp_path / str(at) / "place"
        place.mkdir(parents=True)
        (place / "a.json").write_bytes(OLD)
        with failing(at) as seen:
            try:
                write(place)
            except OSError:  # that of the last call, which syncs the name, finds the new file
                assert contents(place.parent) in (BEFORE, AFTER), (at, seen)
            else:  # of clearing up
                assert (place / "a.json").read_bytes() == NEW
        if len(seen) < at:
            break
    assert contents(place.parent) == AFTER
    assert at > 4


@every_writer
def test_an_exception_leaves_the_old_file(write, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write(place)
    assert contents(place.parent) == BEFORE


@every_writer
def test_a_file_at_its_size_limit_leaves_the_old_one_and_is_reported(write, place: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(NEW) // 2, hard))
    facts = {"path": str(place), "reason": "the file has its largest size", "errno": errno.EFBIG}
    try:
        with refused(OutputError, "not-written", **facts), writing(place):
            write(place)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert contents(place.parent) == BEFORE


@every_writer
def test_a_writer_that_is_killed_leaves_the_old_file_and_the_next_one_is_not_disturbed(write, place: Path) -> None:
    child = os.fork()
    if child == 0:
        os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL)
        write(place)
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    assert (place / "a.json").read_bytes() == OLD
    left = [path for path in place.parent.rglob("*") if ".partial" in path.name]
    assert len(left) == 1
    write(place)
    assert (place / "a.json").read_bytes() == NEW
    assert left[0].exists() != (write is locked)  # who holds the lock replaces the remainder


@every_writer
def test_permissions_are_those_of_a_usual_open(write, place: Path) -> None:
    before = os.umask(0o027)
    try:
        (place / "a.json").unlink()
        write(place)
        assert (place / "a.json").stat().st_mode & 0o777 == 0o640
        if write is not directory:
            (place / "a.json").chmod(0o600)
            write(place)
            assert (place / "a.json").stat().st_mode & 0o777 == 0o600
    finally:
        os.umask(before)


@pytest.mark.parametrize("write", WRITERS[:-1])
def test_a_link_is_replaced_and_what_it_names_is_unchanged(write, place: Path, tmp_path: Path) -> None:
    other = tmp_path / "thesis.tex"
    (place / "a.json").rename(other)
    (place / "a.json").symlink_to(other)
    write(place)
    assert not (place / "a.json").is_symlink()
    assert (other.read_bytes(), (place / "a.json").read_bytes()) == (OLD, NEW)


def test_a_previous_directory_that_cannot_be_removed_is_kept_beside_the_new_one(place: Path) -> None:
    def refuse(_: Path) -> None:
        raise OSError(errno.ENOTEMPTY, "Directory not empty")

    with whole_directory(place, refuse) as partial:
        (partial / "a.json").write_bytes(NEW)
    aside = [path for path in place.parent.iterdir() if path != place]
    assert [(aside[0] / "a.json").read_bytes(), (place / "a.json").read_bytes()] == [OLD, NEW]


def on_a_small_disk(folder: Path, kind: str) -> None:
    """Every writer on a file system that is full or read-only; for a process of its own."""
    for write in WRITERS:
        place = folder / write.__name__
        before = contents(folder)
        try:
            with writing(place, RecordError):
                write(place)
        except LivebodeError as error:
            print(error.code, error.reason, error.remedy, sep=" | ")
        assert contents(folder) == before, (write, kind)


def test_a_full_and_a_read_only_disk_are_reported_and_change_nothing(tmp_path: Path) -> None:
    made = "; ".join(f"mkdir {tmp_path / write.__name__}" for write in WRITERS)
    code = "import sys; from pathlib import Path; from tests.core.test_files_fault import on_a_small_disk as f; "
    python = f"{sys.executable} -c '{code}f(Path(sys.argv[1]), sys.argv[2])' {tmp_path}"
    steps = (
        f"mount -t tmpfs -o size=128k none {tmp_path}; {made}; {python} full; "
        f"mount -o remount,ro {tmp_path}; {python} read-only"
    )
    allowed = subprocess.run(["unshare", "-Urm", "true"], capture_output=True, text=True, check=False)
    if allowed.returncode:
        pytest.skip(f"this system lets a user mount no small file system: {allowed.stderr.strip()}")
    done = subprocess.run(
        ["unshare", "-Urm", "sh", "-ec", steps], cwd=Path(__file__).parents[2], capture_output=True, text=True,
        check=False, env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    full = "record.not-written | the disk is full | free some space, or choose another path"
    read_only = "record.not-written | the disk is read-only | check its permissions, or choose another path"
    assert done.stdout.splitlines() == [full] * len(WRITERS) + [read_only] * len(WRITERS)
