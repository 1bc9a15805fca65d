"""The versions of a baseline: what each was learned from, when and why, and the file of each earlier one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class BaselineVersion:
    """One version of a baseline.

    Attributes
    ----------
    id
        The first 16 hexadecimal digits of the SHA-256 of what was learned: two files with one id judge alike.
    learned
        When, ISO 8601 in UTC.
    runs
        The runs that it was learned from.
    reason
        Why it was learned; empty where nobody stated it.
    """

    id: str
    learned: str
    runs: tuple[str, ...]
    reason: str


def file_of(baseline: Path, version: str | None) -> Path:
    """The file of this version: the retained one, if there is one; else the baseline, the newest version."""
    retained = None if version is None else retained_file(baseline, version)
    return baseline if retained is None or not retained.exists() else retained


def retained_file(baseline: Path, version: str) -> Path:
    """The file of an earlier version of this baseline.

    >>> retained_file(Path("press/healthy.json"), "3f2a91d05c77b64e").as_posix()
    'press/healthy.history/3f2a91d05c77b64e.json'
    """
    return baseline.with_suffix(".history") / f"{version}.json"
