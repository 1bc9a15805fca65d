"""references.json: what a person saves with a run is read back exactly, and a damaged file is not."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given, settings

from livebode.core import Lines, RecordError, Responses
from livebode.records import SavedCurves, change_saved, read_saved
from livebode.records.removal import foreign
from livebode.records.saved_curves import ANNOTATIONS_MAX, SAVED
from tests.support.errors import refused
from tests.support.responses import any_responses, assert_same, made

LINES = Lines.parse("20:140:10", 4000.0, 400)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("saved")
    (found / "run.json").write_text("{}")
    return found


@settings(max_examples=20, deadline=None)
@given(any_responses())
def test_references_and_annotations_are_read_as_they_were_saved(run: Path, responses: Responses) -> None:
    one = responses[:1]
    change_saved(run, lambda _: SavedCurves().with_reference("ölig", one).with_annotation("Riemen", 62.5))
    found = read_saved(run)
    assert_same(found.references[0].response, one)
    assert found.references[0].response.lines.frequency_hz.tolist() == one.lines.frequency_hz.tolist()
    assert (found.references[0].name, found.annotations[0].text, found.annotations[0].frequency_hz) == (
        "ölig", "Riemen", 62.5,
    )  # fmt: skip
    change_saved(run, lambda saved: saved.without(found.annotations[0].id))
    assert (len(read_saved(run).references), read_saved(run).annotations) == (1, ())
    assert foreign(run) == [], "livebode removes it with the run"


def test_a_damaged_file_is_refused_and_remains(run: Path) -> None:
    change_saved(run, lambda _: SavedCurves().with_reference("a", made(1, LINES)))
    data = (run / SAVED).read_bytes()
    for wrong in (data.replace(b'"window": 400', b'"window": 401'), b"", b"[]", data[:-40]):
        (run / SAVED).write_bytes(wrong)
        with refused(RecordError, "damaged"):
            read_saved(run)
        with refused(RecordError, "damaged"):
            change_saved(run, lambda saved: saved)
        assert (run / SAVED).read_bytes() == wrong
    (run / SAVED).unlink()
    os.symlink(run / "run.json", run / SAVED)
    with refused(RecordError, "not-own-file"):
        read_saved(run)
    (run / SAVED).unlink()


def test_a_run_without_a_directory_and_too_many_annotations_are_refused(tmp_path: Path) -> None:
    with refused(RecordError, "no-directory"):
        change_saved(tmp_path / "run", lambda saved: saved)
    assert read_saved(tmp_path) == SavedCurves()
    full = SavedCurves()
    for _ in range(ANNOTATIONS_MAX):
        full = full.with_annotation("x", 1.0)
    with refused(RecordError, "too-large"):
        full.with_annotation("x", 1.0)
