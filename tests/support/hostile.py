"""Hostile directories: what livebode wrote, and among it, beside it and behind links what belongs to somebody else."""

from __future__ import annotations

import json
import os
import shutil
import socket
import stat
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

PRECIOUS = b"years of work\n"
OLD_S = 30 * 86_400.0
NAMES = (
    "thesis.tex", "a b.txt", "zeile\nzwei.txt", "übung.csv", "測試.parquet", "%2e%2e", "..victim", "-rf", "RUN.JSON",
    "Report.html", "report.html.bak", "responses.parquet.old", "000001.parquet", "1.journal", ".hidden",
    "design.json~", "part-00000-backup.parquet", "rows-2024.parquet", f"{'0' * 64}.parquet", "events.JSONL",
    "lake.db", "axis.toml.orig", "MAIN.st.bak", "x.partial", ".run.json.partial-mine", "_delta_log.zip",
    "day=2026-01-01",
)  # fmt: skip
"""Names of somebody else's files; some are nearly those of livebode."""
OWN_NAMES = (
    "run.json", "events.jsonl", "manifest.jsonl", "responses.parquet", "bode.svg", "report.html", "gains.toml",
    "shaper.h", "filters.h", "tune.json", "notes.json", "responses", "samples", "open", "damaged",
    "open/000001.journal", "axis.toml", "responses/000001.parquet", ".run.json.partial", ".pictures.partial",
    "design.json", "excitation.csv", "MAIN.st", "tables", "tables/runs", "tables/responses",
    "tables/runs/_delta_log", "tables/events", "tables/fleet_events", "a.csv", "excitation.svg", "axis.schema.json",
    "tables/fleet_responses/_delta_log", ".pictures.partial/bode.svg",
)  # fmt: skip
"""Places of livebode's files."""


def write_outside(place: Path) -> None:
    """A tree that livebode has nothing to do with, some of it with livebode's names."""
    for name in ("", "responses", "open", "_delta_log", "deep/er"):
        (place / name).mkdir(parents=True, exist_ok=True)
    for name in (
        *NAMES, "victim", "run.json", "events.jsonl", "bode.svg", "responses/000001.parquet", "open/000001.journal",
        "deep/er/x", "_delta_log/00000000000000000000.json",
    ):  # fmt: skip
        (place / name).write_bytes(PRECIOUS)


def make_hostile(work: Path, outside: Path, rng: np.random.Generator) -> list[Path]:
    """Change a directory in up to four ways; what belongs to somebody else now."""
    mine: list[Path] = []
    for _ in range(int(rng.integers(5))):
        change = CHANGES[rng.integers(len(CHANGES))]
        with suppress(OSError):  # of a change that is not possible here
            mine += change(work, outside, rng)
    _age(work)
    return [path for path in mine if os.path.lexists(path)]


def state_of(paths: Sequence[Path]) -> dict[Path, tuple[int, object]]:
    """Kind and content of each path, and of all below a directory."""
    found: dict[Path, tuple[int, object]] = {}
    for path in paths:
        if not os.path.lexists(path):
            continue
        kind = stat.S_IFMT(path.lstat().st_mode)
        content: object = None
        if stat.S_ISLNK(kind):
            content = os.readlink(path)
        elif stat.S_ISREG(kind):
            content = path.read_bytes()
        elif stat.S_ISDIR(kind):
            found |= state_of(sorted(path.iterdir()))
        found[path] = (kind, content)
    return found


def _any_directory(work: Path, rng: np.random.Generator) -> Path:
    found = sorted(path for path in (work, *work.rglob("*")) if path.is_dir() and not path.is_symlink())
    return found[rng.integers(len(found))]


def _file(work: Path, _: Path, rng: np.random.Generator) -> list[Path]:
    """A file somewhere, often with a name that is nearly one of livebode's."""
    path = _any_directory(work, rng) / NAMES[rng.integers(len(NAMES))]
    path.write_bytes(PRECIOUS)
    return [path]


def _folder(work: Path, _: Path, rng: np.random.Generator) -> list[Path]:
    path = _any_directory(work, rng) / NAMES[rng.integers(len(NAMES))]
    (path / "deep" / "er").mkdir(parents=True)
    for name in NAMES[: int(rng.integers(1, 4))]:
        (path / "deep" / name).write_bytes(PRECIOUS)
    return [path]


def _link(work: Path, outside: Path, rng: np.random.Generator) -> list[Path]:
    path = _any_directory(work, rng) / NAMES[rng.integers(len(NAMES))]
    path.symlink_to([outside, outside / "victim", outside / "deep", Path("/nowhere")][rng.integers(4)])
    return [path]


def _hard_link(work: Path, outside: Path, rng: np.random.Generator) -> list[Path]:
    """A second name of a file outside: with a name of its own, or with one of livebode's, whose content is not."""
    if rng.random() < 0.5:
        path = _any_directory(work, rng) / NAMES[rng.integers(len(NAMES))]
        os.link(outside / "victim", path)
        return [path]
    path = work / OWN_NAMES[rng.integers(len(OWN_NAMES))]
    if path.is_file() and not path.is_symlink():
        path.unlink()
    os.link(outside / "events.jsonl", path)
    return []


def _special(work: Path, _: Path, rng: np.random.Generator) -> list[Path]:
    """A pipe or a socket, with a name of its own or in the place of livebode's."""
    name = (NAMES, OWN_NAMES)[int(rng.integers(2))]
    path = work / name[rng.integers(len(name))]
    if path.is_file() and not path.is_symlink():
        path.unlink()
    if rng.random() < 0.5:
        os.mkfifo(path)
    else:
        with _at(path.parent), socket.socket(socket.AF_UNIX) as one:
            one.bind(path.name)
    return [path]


def _link_instead(work: Path, outside: Path, rng: np.random.Generator) -> list[Path]:
    """A link in the place of a file or directory of livebode; the link itself is not somebody's work."""
    path = work / OWN_NAMES[rng.integers(len(OWN_NAMES))]
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
    same = outside / path.name
    path.symlink_to(same if same.exists() else [outside, outside / "victim"][rng.integers(2)])
    return []


def _folder_instead(work: Path, _: Path, rng: np.random.Generator) -> list[Path]:
    """Somebody's directory in the place of a file of livebode."""
    path = work / OWN_NAMES[rng.integers(len(OWN_NAMES))]
    if path.is_dir() and not path.is_symlink():
        path = path / "000001.parquet"
    path.unlink(missing_ok=True)
    path.mkdir()
    (path / "thesis.tex").write_bytes(PRECIOUS)
    return [path / "thesis.tex"]


def _read_only(work: Path, _: Path, rng: np.random.Generator) -> list[Path]:
    path = _any_directory(work, rng)
    (path / "mine.txt").write_bytes(PRECIOUS)
    path.chmod(0o555)
    return [path / "mine.txt"]


def _elsewhere(work: Path, outside: Path, rng: np.random.Generator) -> list[Path]:
    """A table of the lake, the run or the design lists files that are not in its directory."""
    names = [
        "../victim", str(outside / "victim"), "%2e%2e/victim", f"..%2F{outside.name}%2Fvictim", "./../victim",
        "link/victim", "../../../outside/victim", "VICTIM", "", ".", "..", "thesis.tex", f"file://{outside}/victim",
        "run.json/../victim",
    ]  # fmt: skip
    listed = [names[rng.integers(len(names))] for _ in range(3)]
    mine = []
    for log in sorted(work.glob("tables/*/_delta_log")):
        if log.is_symlink() or rng.random() < 0.5:
            continue
        mine.append(log.parent / "thesis.tex")
        _append_to(log, listed, outside)
    for file, key in ((work / "design.json", "files"), (work / "manifest.jsonl", None)):
        if file.is_file() and not file.is_symlink():
            if key is None:
                file.write_bytes(file.read_bytes() + json.dumps({"removed": listed}).encode() * 2)
            else:
                file.write_text(
                    json.dumps({key: [*listed, "axis.toml", "axis.schema.json", "design.json", "thesis.tex"]})
                )
            mine.append(work / "thesis.tex")
    for path in mine:
        if path.parent.is_dir() and not os.path.lexists(path):
            path.write_bytes(PRECIOUS)
    return mine


def _append_to(log: Path, names: list[str], outside: Path) -> None:
    versions = sorted(path for path in log.glob("0*.json"))
    if not versions:
        return
    number = int(versions[-1].stem) + 1
    lines = []
    for name in names:
        size = (outside / "victim").stat().st_size
        lines.append(
            {"add": {"path": name, "partitionValues": {}, "size": size, "modificationTime": 0, "dataChange": True}}
        )
        lines.append({"remove": {"path": name, "deletionTimestamp": 1, "dataChange": True, "partitionValues": {}}})
    (log / f"{number:020}.json").write_text("\n".join(map(json.dumps, lines)))


CHANGES: tuple[Callable[[Path, Path, np.random.Generator], list[Path]], ...] = (
    _file, _folder, _link, _hard_link, _special, _link_instead, _folder_instead, _read_only, _elsewhere,
)  # fmt: skip


def _age(work: Path) -> None:
    """Make everything older than anything is retained."""
    for path in (work, *work.rglob("*")):
        with suppress(OSError):
            at_s = path.lstat().st_mtime - OLD_S
            os.utime(path, (at_s, at_s), follow_symlinks=False)


@contextmanager
def _at(folder: Path) -> Iterator[None]:
    """In this directory: the path of a socket has 108 letters at most."""
    before = os.open(".", os.O_RDONLY)
    os.chdir(folder)
    try:
        yield
    finally:
        os.fchdir(before)
        os.close(before)
