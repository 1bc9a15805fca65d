"""The texts of the first page may change while a run is recorded: another operator continues it."""

from __future__ import annotations

from pathlib import Path

from livebode.estimation import Tracker
from livebode.records import RunRecord
from tests.support import stored
from tests.support.runs import record


def test_a_run_that_another_operator_continues_has_the_new_name(tmp_path: Path) -> None:
    stored.in_segments(tmp_path / "run")
    about = {"configuration": {"record": stored.KEPT.model_dump(), "report": {"operator": "Bob"}}}
    source = stored.Source(stored.data(), stored.SAMPLES, stored.BLOCK, lambda _: None)
    record(source, Tracker(stored.SETTINGS), tmp_path / "run", about=about, segments=stored.KEPT)
    found = RunRecord.open(tmp_path / "run")
    assert (found.finished, found.summary["configuration"]["report"]) == (True, {"operator": "Bob"})
