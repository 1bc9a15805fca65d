"""A run that was begun by another version of livebode continues rightly, or is refused with both versions named."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from livebode.configuration import Axis
from livebode.core import RecordError, StateError
from livebode.records import RUN, RunRecord, frames, last_commit, to_frame
from livebode.records.segments.frames import COMMIT
from livebode.records.segments.journal import Commit
from livebode.records.summary_file import COPY, from_document, to_document
from livebode.runtime import Destination, Document, TrackerResults, run
from livebode.version import __version__
from tests.support.command import signals, write_parquet
from tests.support.errors import refused
from tests.support.recorded import same

HEAD = struct.Struct("<4sHHII")
SAMPLES = 6000
States = dict[str, bytes]


class StopError(Exception):
    pass


def axis_of(folder: Path, **sections: Any) -> Axis:
    log = folder / "log.parquet"
    if not log.exists():
        write_parquet(log, signals(SAMPLES))
    data = {
        "source": {"log": str(log)},
        "signals": {"output": "y", "input": "u", "excitation": "w"},
        "lines": {"frequencies": "50,100,200", "window": 100},
        "record": {},
    }
    return Axis.of(data | sections, "test")


def recorded(axis: Axis, directory: Path, until: int | None = None) -> RunRecord:
    """A run to its end, or stopped behind this sample."""

    def stop(document: Document) -> None:
        if until is not None and isinstance(document, TrackerResults) and document.samples > until:
            raise StopError

    to = Destination(directory, lambda *_: None, subscribers=(stop,))
    if until is None:
        run(axis, to)
    else:
        with pytest.raises(StopError):
            run(axis, to)
    return RunRecord.open(directory)


def rewritten(state: bytes, *, encodings: int = 0, versions: int = 0, livebode: str | None = "9.8.7") -> bytes:
    """The state as another version would write it: other numbers and its own name, with right checksums."""
    magic, encoding, version, length, check = HEAD.unpack_from(state)
    at = HEAD.size + 4
    description, rest = json.loads(state[at : at + length]), state[at + length :]
    assert description.pop("livebode") == __version__
    if livebode is not None:
        description["livebode"] = livebode
    arrays = len(rest) - sum(description["parts"].values())
    text = json.dumps(description, separators=(",", ":")).encode()
    check = zlib.crc32(rest[:arrays], zlib.crc32(text))
    head = HEAD.pack(magic, encoding + encodings, version + versions, len(text), check)
    return head + struct.pack("<I", zlib.crc32(head)) + text + rest


def change_states(directory: Path, change: Callable[[States], States]) -> None:
    """In every commit of the newest journal."""
    file = max((directory / "open").glob("*.journal"))
    found = bytearray()
    for frame in frames(file.read_bytes()):
        assert frame.payload is not None
        if frame.kind == COMMIT:
            commit = Commit.of(frame.payload)
            found += replace(commit, states=change(dict(commit.states))).to_frame()
        else:
            found += to_frame(frame.kind, frame.payload, table=frame.table)
    file.write_bytes(found)


def change_summary(directory: Path, change: Callable[[dict[str, Any]], None]) -> None:
    summary = from_document((directory / RUN).read_bytes())
    change(summary)
    for name in (RUN, COPY):
        (directory / name).write_bytes(to_document(summary))


def files(directory: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in sorted(directory.rglob("*")) if path.is_file()}


def by(name: str) -> Callable[[dict[str, Any]], None]:
    """Let run.json name another version."""
    return lambda summary: summary["versions"].update(livebode=name)


@pytest.mark.parametrize(
    ("changes", "code", "sentence"),
    [
        (
            {"versions": 2}, "newer-version",
            f"the state of 'tracker' has version 3, written by livebode 9.8.7; this is livebode {__version__}, which "
            "reads up to version 1; finish the run with livebode 9.8.7, or start a new run",
        ),
        (
            {"encodings": 1}, "newer-version",
            f"the state of 'tracker' has version 2, written by livebode 9.8.7; this is livebode {__version__}, which "
            "reads up to version 1; finish the run with livebode 9.8.7, or start a new run",
        ),
        (
            {"versions": -1}, "older-version",
            f"the state of 'tracker' has version 0, written by livebode 9.8.7; this is livebode {__version__}, which "
            "reads version 1; finish the run with livebode 9.8.7, or start a new run",
        ),
        (
            {"versions": 1, "livebode": None}, "newer-version",
            f"the state of 'tracker' has version 2, written by another livebode; this is livebode {__version__}, which "
            "reads up to version 1; finish the run with the version that began it, or start a new run",
        ),
    ],
)  # fmt: skip
def test_a_state_of_another_version_is_refused_with_both_versions_and_stays_as_it_is(
    tmp_path: Path, changes: dict[str, Any], code: str, sentence: str
) -> None:
    axis, directory = axis_of(tmp_path), tmp_path / "run"
    recorded(axis, directory, until=3000)
    change_states(directory, lambda states: states | {"tracker": rewritten(states["tracker"], **changes)})
    change_summary(directory, by("9.8.7"))
    before = files(directory)
    with refused(StateError, code, name="tracker", written_by=changes.get("livebode", "9.8.7") or ""):
        run(axis, Destination(directory, lambda *_: None))
    with pytest.raises(StateError) as caught:
        run(axis, Destination(directory, lambda *_: None))
    assert str(caught.value) == f"the unfinished run in {str(directory)!r}: {sentence}"
    assert files(directory) == before


def test_a_run_of_a_version_with_the_same_states_and_fewer_settings_continues_exactly(tmp_path: Path) -> None:
    axis, directory = axis_of(tmp_path), tmp_path / "run"
    whole = recorded(axis, tmp_path / "whole").responses()
    recorded(axis, directory, until=3000)

    def older(summary: dict[str, Any]) -> None:
        """As a version wrote it that knew none of these."""
        for name in ("machine", "motion", "output_only"):
            del summary["configuration"][name]
        for name in ("clock", "kinds"):
            del summary["found"][name]
        for name in ("recipe", "content"):
            del summary[name]
        summary["versions"] = {"livebode": "0.0.9"}

    change_summary(directory, older)
    change_states(directory, lambda states: {name: rewritten(state, livebode=None) for name, state in states.items()})
    found = recorded(axis, directory)
    assert found.finished
    assert same(found.responses(), whole)
    assert found.summary["versions"]["livebode"] == __version__
    assert found.summary["earlier_versions"] == [{"livebode": "0.0.9"}]
    assert found.summary["recipe"]


def test_a_run_that_one_version_recorded_names_no_earlier_one(tmp_path: Path) -> None:
    axis, directory = axis_of(tmp_path), tmp_path / "run"
    recorded(axis, directory, until=3000)
    assert "earlier_versions" not in recorded(axis, directory).summary


@pytest.mark.parametrize("change", [{"machine": {"site": "Graz"}}, {"tracking": {"hop": 10}}, {"fit": {}}])
def test_another_configuration_is_refused_also_by_another_version(tmp_path: Path, change: dict[str, Any]) -> None:
    directory = tmp_path / "run"
    recorded(axis_of(tmp_path), directory, until=3000)
    with refused(RecordError, "configuration-differs", path=str(directory)):
        run(axis_of(tmp_path, **change), Destination(directory, lambda *_: None))
    change_summary(directory, by("0.0.9"))
    with pytest.raises(RecordError, match=f"was started by livebode 0.0.9 .this is {__version__}. with another"):
        run(axis_of(tmp_path, **change), Destination(directory, lambda *_: None))


def test_a_version_with_another_part_is_refused_with_both_versions(tmp_path: Path) -> None:
    axis, directory = axis_of(tmp_path), tmp_path / "run"
    recorded(axis, directory, until=3000)
    commit = last_commit(directory)
    assert commit is not None
    assert {"tracker", "counts"} <= commit.states.keys()
    change_states(directory, lambda states: states | {"wear": states["counts"]})
    change_summary(directory, by("9.8.7"))
    with refused(RecordError, "states-differ", path=str(directory), written_by="9.8.7", names=["wear"]):
        run(axis, Destination(directory, lambda *_: None))


def test_texts_of_the_report_and_the_segmentation_may_change(tmp_path: Path) -> None:
    directory = tmp_path / "run"
    recorded(axis_of(tmp_path), directory, until=3000)
    changed = axis_of(tmp_path, report={"operator": "A. Novak"}, record={"segment_s": 1.0})
    assert recorded(changed, directory).finished
