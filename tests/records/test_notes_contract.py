"""Tags and notes of a run: what is written is read again, and a deleted run leaves nothing behind."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from livebode.core import RecordError
from livebode.records import Notes, delete, read_notes, remove, write_notes
from livebode.records.deletion import DELETED
from livebode.records.notes import NAME

TEXTS = st.text(max_size=2000) | st.just("\U0001f600" * 2000) | st.just("\x00" * 2000) | st.just('"' * 2000)


@settings(max_examples=20)
@given(tags=st.lists(st.text(max_size=41) | st.just("\U0001f600" * 40), max_size=21), text=TEXTS)
def test_notes_that_are_accepted_are_read_as_they_were_written(tags: list[str], text: str) -> None:
    try:
        notes = Notes(tags=tags, text=text)
    except ValidationError:
        return
    assert all(tag == tag.strip() and 0 < len(tag) <= 40 and "," not in tag for tag in notes.tags)
    assert len(set(notes.tags)) == len(notes.tags) <= 20
    with tempfile.TemporaryDirectory() as folder:
        write_notes(Path(folder), notes)
        assert read_notes(Path(folder)) == notes


def test_the_longest_notes_are_read() -> None:
    notes = Notes(tags=[f"{i:02}" + "\U0001f600" * 38 for i in range(20)], text="\x01" * 2000)
    with tempfile.TemporaryDirectory() as folder:
        write_notes(Path(folder), notes)
        assert read_notes(Path(folder)) == notes


def test_a_run_with_notes_is_replaced_as_a_whole(tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir()
    (run / "run.json").write_text("{}")
    write_notes(run, Notes(text="old"))
    remove(run)
    assert not run.exists()


def test_notes_are_not_written_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "precious").write_text("precious")
    (tmp_path / "run" / NAME).symlink_to(tmp_path / "precious")
    with pytest.raises(RecordError, match="not a regular file"):
        write_notes(tmp_path / "run", Notes(text="x"))
    assert (tmp_path / "precious").read_text() == "precious"


def test_runs_of_one_name_are_deleted_one_after_the_other(tmp_path: Path) -> None:
    places = set()
    for i in range(3):
        run = tmp_path / "monday"
        run.mkdir()
        (run / "run.json").write_text(str(i))
        places.add(delete(run))
        assert not run.exists()
    assert sorted((place / "run.json").read_text() for place in places) == ["0", "1", "2"]
    assert {place.parent.parent for place in places} == {tmp_path / DELETED}


@pytest.mark.parametrize("wrong", ["file", "empty", "link", "nowhere"])
def test_what_is_not_a_run_is_not_deleted(tmp_path: Path, wrong: str) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "empty").mkdir()
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "run.json").write_text("{}")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with pytest.raises(RecordError, match="not the directory of a run"):
        delete(tmp_path / wrong)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "file", "link", "real"]


def test_a_run_is_not_deleted_into_a_link(tmp_path: Path) -> None:
    (tmp_path / "runs" / "monday").mkdir(parents=True)
    (tmp_path / "runs" / "monday" / "run.json").write_text("{}")
    (tmp_path / "outside").mkdir()
    (tmp_path / "runs" / DELETED).symlink_to(tmp_path / "outside")
    with pytest.raises(RecordError, match="could not be written"):
        delete(tmp_path / "runs" / "monday")
    assert (tmp_path / "runs" / "monday" / "run.json").is_file()
    assert list((tmp_path / "outside").iterdir()) == []
