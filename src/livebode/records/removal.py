"""Remove a run: only files that livebode writes, by name."""

from __future__ import annotations

import contextlib
import re
import stat
from pathlib import Path

from livebode.core import RecordError, remove_empty, remove_files
from livebode.records.inside import is_folder
from livebode.records.summary_file import COPY, RUN, is_run, read_summary

_SHOWN = 5
_PARTIAL = r"\.partial(-[0-9a-f]{8})?"  # of livebode.core.files
_DRAWN = r"(bode|tracking|modes|margins|validation|singular-values|tune|friction|orders|stabilisation)\.svg"
_PROPOSED = r"gains\.(toml|csv)|filters\.(h|st)|odrive\.txt|shaper\.(h|st|cfg)"
_REPLACED = rf"(run|run-copy|references|notes|loop-check|tune)\.json|report\.(html|pdf)|{_DRAWN}|{_PROPOSED}"
_FILES = re.compile(
    rf"{_REPLACED}|\.({_REPLACED}){_PARTIAL}|(events|manifest)\.jsonl|(responses|covariance|parameters)\.parquet"
)
_SEGMENT = re.compile(r"\d{6,9}(-\d{6,9})?\.parquet|\.\d{6,9}(-\d{6,9})?\.parquet\.partial")
_JOURNAL = re.compile(r"\d{6,9}\.journal|\.\d{6,9}\.journal\.partial")
_PICTURE = re.compile(rf"[a-z-]+\.svg|\.[a-z-]+\.svg{_PARTIAL}")
_FOLDERS = {
    "responses": _SEGMENT, "covariance": _SEGMENT, "parameters": _SEGMENT, "samples": _SEGMENT,
    "responses_1s": _SEGMENT, "responses_1min": _SEGMENT, "responses_1h": _SEGMENT,
    "open": _JOURNAL, "damaged": _JOURNAL,
    ".pictures.partial": _PICTURE,
}  # fmt: skip


def foreign(run: Path) -> list[str]:
    """Entries in the directory of a run that livebode did not write: other names, links, pipes, devices."""
    names = []
    for path in sorted(run.iterdir()):
        inner = _FOLDERS.get(path.name)
        if inner is None or not is_folder(path):
            names += [] if _FILES.fullmatch(path.name) and _regular(path) else [path.name]
        else:
            names += [f"{path.name}/{p.name}" for p in sorted(path.iterdir()) if not _written(p, inner)]
    return names


def check_removable(path: Path) -> None:
    """RecordError if this is neither an empty directory nor that of a run without foreign files."""
    if not is_folder(path) or (any(path.iterdir()) and not is_run(path)):
        raise RecordError(
            "not-a-run",
            f"{str(path)!r} is not the directory of a run, so it is not replaced",
            "choose another path",
            path=str(path),
        )
    if not any(path.iterdir()):
        return
    read_summary(path)
    if others := foreign(path):
        named = ", ".join(others[:_SHOWN]) + f" and {len(others) - _SHOWN} more" * (len(others) > _SHOWN)
        runs = all(is_run(path / name) for name in others)
        what = "other runs" if runs else "files that livebode did not write"
        raise RecordError(
            "foreign-files",
            f"{str(path)!r} is not replaced, because it contains {what}: {named}",
            "move them away, or choose another path",
            path=str(path),
            files=others,
        )


def remove(run: Path, *, itself: bool = True) -> None:
    """Remove what livebode wrote there, and the directory itself if it is then empty.

    Raises
    ------
    OSError
        If something cannot be removed, or there are other files.
    """
    for name in _FOLDERS:
        remove_folder(run, name)
    # Without them the rest is not a run: they are removed last, so that an interrupted removal can be repeated.
    names = {path.name for path in run.iterdir() if _written(path, _FILES)}
    last = [name for name in (COPY, RUN) if name in names]
    remove_files(run, [*sorted(names.difference(last)), *last])
    if itself:
        remove_empty(run)


def remove_folder(run: Path, name: str) -> None:
    """Remove what livebode wrote to a directory of a run, and the directory itself if it is then empty."""
    folder = run / name
    if is_folder(folder):
        remove_files(folder, [path.name for path in folder.iterdir() if _written(path, _FOLDERS[name])])
        with contextlib.suppress(OSError):
            remove_empty(folder)


def _written(path: Path, names: re.Pattern[str]) -> bool:
    return bool(names.fullmatch(path.name)) and _regular(path)


def _regular(path: Path) -> bool:
    return stat.S_ISREG(path.lstat().st_mode)
