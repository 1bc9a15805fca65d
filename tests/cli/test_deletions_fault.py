"""Hostile directories and every command that removes or replaces: nothing of somebody else is touched.

`make deletions` takes 1,000 of them.
"""

from __future__ import annotations

import os
import shutil
import stat
import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.core import LivebodeError
from livebode.publishing.outbox import Outbox
from livebode.records import RunDirectory
from livebode.runtime.segmented import make_way
from livebode_plant.fleet.fleet_settings import SinkSection
from livebode_plant.fleet.sink_tables import SinkTables
from livebode_plant.lake import TABLES
from tests.support.archives import coordinator, loop, write_archive
from tests.support.command import livebode, signals, write_csv
from tests.support.damaged import make_runs, record_run
from tests.support.hostile import make_hostile, state_of, write_outside

DIRECTORIES = int(os.environ.get("LIVEBODE_DELETIONS", "14"))
AXIS = """
[source]
log = "log.csv"
[signals]
excitation = "w"
input = "u"
output = "y"
[lines]
frequencies = "50,100,200"
window = 100
"""
EXPERIMENT = """
[belt.strokes]
speed_m_per_s = 0.38
[limits]
torque_n_m_max = 14.5
following_error_m_max = 0.02
[excitation]
band_hz = [20, 60]
resolution_hz = 10
accuracy = 0.2
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What livebode writes, once: runs, a design, function blocks and a lake in the directory of the project."""
    made = tmp_path_factory.mktemp("made")
    make_runs(made)
    write_csv(made / "log.csv", signals())
    (made / "axis.toml").write_text(AXIS)
    (made / "experiment.toml").write_text(EXPERIMENT)
    for arguments in (
        ("run", made / "axis.toml", "--out", made / "run"),
        ("design", made / "experiment.toml", "--out", made / "design"),
        ("plc", made / "axis.toml", "--limit", 4, "--amplitude", 1, "--rate", 1000, "--out", made / "plc"),
    ):
        done = livebode(*arguments)
        assert done.code == 0, done.err
    archive = write_archive(made / "lake", 2)
    archive.write_text(archive.read_text().replace('lake = "lake"', 'lake = "."'))
    lake = loop(archive, str(made / "lake"))
    for name in TABLES:  # one that was joined, so that there is something to remove
        lake.created(name)
    livebode("archive", "run", archive, "--compact")
    shutil.copytree(made / "piece", made / "lake" / "runs" / "monday")
    return made


class RefusedError(Exception):
    """The command ended with a sentence."""


KINDS = ("piece", "segments", "killed", "run", "design", "plc", "lake")


def commands(made: Path, work: Path, folder: Path) -> dict[str, Callable[[], Any]]:
    """Every command that removes or replaces, with the directory as what it may remove or replace something in."""
    axis, archive = made / "axis.toml", folder / "archive.toml"
    inputs = "lake/plant/{machine}/*.parquet" if (work / "plant").exists() else "nothing/*.csv"  # all of it is known
    archive.write_text(f'inputs = ["{made}/{inputs}"]\nrecipe = "{made}/lake/recipe.toml"\nlake = "{work}"\n')

    def command(*arguments: object) -> Callable[[], Any]:
        def call() -> None:
            done = livebode(*arguments)
            assert "Traceback" not in done.err, (arguments, done.err)
            if done.code:
                raise RefusedError

        return call

    return {
        "archive run --compact": command("archive", "run", archive, "--compact"),
        "archive run": coordinator(archive).run,
        "fleet sink": lambda: SinkTables(SinkSection(lake=str(work), full_rate_days=1.0)).resume(0.0),
        "run": command("run", axis, "--out", work, "--force"),
        "run in pieces": lambda: RunDirectory(work, force=True).__enter__(),
        "run in segments": lambda: make_way(work),
        "run that continues": lambda: record_run(work),
        "run of several": command("run", axis, "--out", work / "monday", "--force"),
        "design": command("design", made / "experiment.toml", "--out", work, "--force", "--to", "csv"),
        "plc": command("plc", axis, "--limit", 4, "--amplitude", 1, "--rate", 1000, "--out", work, "--force"),
        "example": command("example", "standstill", "--out", work, "--force"),
        "report": command("report", work, "--out", work / "report.html", "--force"),
        "export": command("export", work, "--to", "csv", "--out", work / "a.csv", "--force"),
        "configuration": command("inspect", made / "log.csv", "--yes", "--out", work / "axis.toml", "--force"),
        "schema": command("doctor", "--schema", "axis", "--out", work / "axis.schema.json", "--force"),
        "publish": lambda: _outbox(work / "outbox.sqlite"),
    }


def _outbox(path: Path) -> None:
    outbox = Outbox(path, lambda _: None)
    outbox.flush()
    outbox.close()


def test_nothing_of_somebody_else_is_touched(tmp_path: Path, made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebode_reports.svg.pictures_svg", lambda _: {})  # most of the time of a report
    monkeypatch.setattr("livebode_reports.html.to_html", lambda *_: "")
    monkeypatch.setattr("livebode_reports.pdf.save_pdf", lambda _, path, __: path.write_bytes(b""))
    rng, done, refused = np.random.default_rng(34), Counter[str](), Counter[str]()
    for number in range(DIRECTORIES):
        folder = tmp_path / "each"
        _clear(folder)
        outside, work = folder / "outside", folder / "work"
        write_outside(outside)
        shutil.copytree(made / KINDS[number % len(KINDS)], work)
        mine = [outside, *make_hostile(work, outside, rng)]
        before = state_of(mine)
        if rng.random() < 0.1:  # the directory itself is a link
            work.rename(folder / "real")
            work.symlink_to("real")
        calls = commands(made, work, folder)
        for name in rng.permutation(list(calls)):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                try:
                    calls[name]()
                    done[str(name)] += 1
                except (LivebodeError, RefusedError):
                    refused[str(name)] += 1
            assert state_of(mine) == before, (number, name)
    print(f"{DIRECTORIES} hostile directories: 0 files of others touched by {len(calls)} commands, done and refused:")
    print(", ".join(f"{name} {done[name]} + {refused[name]}" for name in calls))
    assert all(done[name] for name in calls) or DIRECTORIES < 1000  # each does its work in some of them


def _clear(folder: Path) -> None:
    """Remove what the test made, also where it may not be written."""
    for path, _, _ in os.walk(folder):
        with suppress(OSError):
            os.chmod(path, stat.S_IRWXU)
    shutil.rmtree(folder, ignore_errors=True)


def test_runs_of_several_outputs_are_not_put_into_a_run_and_replaced_only_together(tmp_path: Path) -> None:
    columns = signals()
    log = write_csv(tmp_path / "log.csv", columns | {"z": -columns["y"]})
    track: list[object] = ["run", log, "--excitation", "w", "--input", "u", "--lines", "50,100,200", "--window", 100]
    both = [*track, "--output", "y", "--output", "z"]
    one = tmp_path / "one"
    assert livebode(*track, "--output", "y", "--out", one).code == 0
    before = state_of([one])
    for force in ([], ["--force"]):
        refused = livebode(*both, "--out", one, *force)
        sentence = f"{str(one)!r} is the directory of a run, so the runs of y, z are not written into it"
        assert (refused.code, sentence in refused.err) == (2, True), refused.err
        assert state_of([one]) == before
    assert livebode(*track, "--output", "y", "--out", one, "--force").code == 0

    several = tmp_path / "several"
    assert livebode(*both, "--out", several).code == 0
    assert livebode(*both, "--out", several, "--force").code == 0
    (several / "z" / "mine.txt").write_text("mine")
    before = state_of([several])
    refused = livebode(*both, "--out", several, "--force")
    assert (refused.code, "files that livebode did not write: mine.txt" in refused.err) == (2, True), refused.err
    assert state_of([several]) == before

    shutil.copytree(several / "y", one / "y")
    refused = livebode(*track, "--output", "y", "--out", one, "--force")
    assert (refused.code, "it contains other runs: y; move them away" in refused.err) == (2, True), refused.err
    (one / "y").rename(tmp_path / "y")
    assert livebode(*track, "--output", "y", "--out", one, "--force").code == 0
