"""What a run does is published from its beginning: a person sees progress at once, and no silence where it ends."""

from __future__ import annotations

import time
from pathlib import Path

from livebode.cli.running import _STEPS
from livebode.configuration import Axis
from livebode.dashboard.hub import Hub
from livebode.dashboard.state import State
from livebode.records import RunRecord
from livebode.runtime import Destination, Document, RunEnded, RunStarted, RunStep, TrackerResults, run
from tests.support.command import signals, write_parquet
from tests.support.terminals import on_terminal


def axis(folder: Path) -> Axis:
    log = write_parquet(folder / "log.parquet", signals())
    roles = {"excitation": "w", "input": "u", "output": "y"}
    return Axis.of({"source": {"log": str(log)}, "signals": roles, "lines": {"window": 100}}, "test")


def test_each_step_of_a_recording_is_published_when_it_begins(tmp_path: Path) -> None:
    published: list[str] = []

    def listen(document: Document) -> None:
        if isinstance(document, RunStep):
            assert not (tmp_path / "run").exists()
            published.append(document.name)
        elif isinstance(document, (RunStarted, TrackerResults, RunEnded)) and type(document).__name__ != published[-1]:
            published.append(type(document).__name__)

    run(axis(tmp_path), Destination(tmp_path / "run", lambda *_: None, subscribers=(listen,)))
    begun = ["opening", "lines", "examining", "tracking"]
    assert published == [*begun, "RunStarted", "TrackerResults", "ending", "RunEnded"]
    assert list(_STEPS) == [*begun, "ending"]
    done = [share for _, share in _STEPS.values()]
    assert done == sorted(done)


def test_a_terminal_shows_progress_before_the_first_sample_is_tracked(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", signals())
    roles = ("--excitation", "w", "--input", "u", "--output", "y", "--window", 100)
    code, shown = on_terminal("run", log, *roles, "--out", tmp_path / "run", columns=120)
    assert code == 0, shown
    assert "opening the recording" in shown
    assert shown.index("opening the recording") < shown.index("plant G")


def test_a_run_that_draws_its_pictures_is_not_silent(tmp_path: Path) -> None:
    """Drawing takes longer than a machine may be silent; the page has no word of it."""
    hub = Hub("axis")
    state, silences = State("axis", 0, hub), []

    def draw(*_: object) -> None:
        state.refresh()
        time.sleep(2.1)
        silences.append(state.silence())

    run(axis(tmp_path), Destination(tmp_path / "run", draw, subscribers=(hub,)))
    ((silent_s, stale),) = silences
    assert silent_s > 2
    assert not stale
    assert RunRecord.open(tmp_path / "run").ended
