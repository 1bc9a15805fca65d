"""The newest proposal of `livebode tune` of a run, from what it was asked for: tune.json."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.core import LivebodeError, RecordError, write_whole
from livebode.records import read_bytes, to_json

if TYPE_CHECKING:
    from livebode.configuration import LoopSection
    from livebode_control.proposal.tune_file import StoredProposal
    from livebode_control.tuning import ControllerProposal

_FILE = "tune.json"
_BYTES_MAX = 1 << 20
_SAME = 1e-3  # of each value: another processor rounds differently


def store_proposal(proposal: ControllerProposal, directory: Path, loop: LoopSection | None, entry: str | None) -> None:
    """Write tune.json: the proposal, and the description of the loop and the entry that were given for it."""
    described = None if loop is None else loop.model_dump(mode="json", exclude_defaults=True, by_alias=True)
    text = to_json(proposal.plain() | {"loop": described, "entry": entry}, indent=2)
    write_whole(directory / _FILE, f"{text}\n".encode())


def stored_proposal(directory: Path) -> StoredProposal | None:
    """The proposal of the newest `livebode tune` of a run as it was written; None without one.

    Raises
    ------
    RecordError
        If tune.json is damaged.
    """
    if not (directory / _FILE).exists():
        return None
    from pydantic import ValidationError

    from livebode_control.proposal.tune_file import StoredProposal  # with pydantic

    try:
        return StoredProposal.model_validate_json(read_bytes(directory, _FILE, _BYTES_MAX))
    except (OSError, ValidationError, LivebodeError):
        raise _again(directory, "is damaged") from None


def newest_proposal(directory: Path, entry: str | None = None) -> ControllerProposal | None:
    """The proposal of the newest `livebode tune` of a run, computed again with its bounds; None without one.

    Parameters
    ----------
    directory
        Run directory.
    entry
        Of a matrix run: "output/input". A proposal for another entry is none.

    Raises
    ------
    RecordError
        If tune.json is damaged, or the run has changed since then and gives another proposal.
    TuneError
        If nothing can be proposed any more.
    """
    stored = stored_proposal(directory)
    if stored is None or stored.entry != entry:
        return None
    from livebode_control.proposal.tune_report import tune_run  # with SciPy

    proposal = tune_run(directory, stored.specification, stored.loop, loop_checked=True, entry=entry)
    before, now = (
        np.array([*_numbers(controller)]) for controller in (stored.controller, proposal.plain()["controller"])
    )
    if before.shape != now.shape or not np.allclose(before, now, rtol=_SAME, atol=0.0):
        raise _again(directory, "has another proposal than the run gives now")
    return proposal


def _again(directory: Path, problem: str) -> RecordError:
    return RecordError(
        "proposal-invalid",
        f"{str(directory / _FILE)!r} {problem}",
        "use livebode tune again",
        path=str(directory / _FILE),
    )


def _numbers(value: Any) -> Iterator[float]:
    """All numbers in nested data, in order."""
    if isinstance(value, dict | list):
        for number in value.values() if isinstance(value, dict) else value:
            yield from _numbers(number)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield float(value)
