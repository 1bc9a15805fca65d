"""Any file of a run is damaged: it is named, and all that is not damaged is read by every command.

`make damage` does it many more times.
"""

from __future__ import annotations

import os
import shutil
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from livebode import Run
from livebode.core import DamageWarning, RecordError
from livebode.dashboard.run_catalogue import runs_in
from livebode.dashboard.run_entry import entry
from livebode.records import RunRecord, delete
from tests.support.command import livebode, signals, write_csv
from tests.support.damaged import check_damage, make_runs, record_run, seen
from tests.support.file_damage import KINDS

FAULTS = int(os.environ.get("LIVEBODE_DAMAGE_FLIPS", "6"))


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return make_runs(tmp_path_factory.mktemp("runs"))


def test_each_damage_of_a_run_is_named_and_the_rest_is_read(runs: dict[str, Path], tmp_path: Path) -> None:
    rng, whole = np.random.default_rng(12), list(runs.values())
    found: Counter[tuple[str, str, str]] = Counter()
    for number in range(FAULTS):
        run, kind = whole[number % len(whole)], list(KINDS)[number // len(whole) % len(KINDS)]
        found[run.name, kind, check_damage(run, tmp_path, rng, kind)] += 1
        if not (number + 1) % 100:
            print(f"{number + 1} faults", flush=True)
    for (run_name, kind, file), count in sorted(found.items()):
        print(f"{run_name:10} {kind:6} {file:20} {count:5} named")


@pytest.mark.parametrize("name", ["piece", "segments", "killed"])
@pytest.mark.parametrize("zeros", [False, True])
def test_lines_that_are_missing_at_the_end_are_named(
    runs: dict[str, Path], tmp_path: Path, name: str, zeros: bool
) -> None:
    for file in ("events.jsonl", "manifest.jsonl"):
        whole = (runs[name] / file).read_bytes()
        ends = [0, *(at + 1 for at, byte in enumerate(whole) if byte == ord("\n"))]
        for end in (ends[-2],) if file == "events.jsonl" else (ends[-3],):  # a line of the manifest is written twice
            run = shutil.copytree(runs[name], tmp_path / f"{file}-{end}")
            (run / file).write_bytes(whole[:end] + bytes(len(whole) - end) * zeros)
            found = seen(run)
            assert {damage.details["file"] for damage in found.damages} == {file}, (end, found.damages)


@pytest.mark.parametrize("zeros", [False, True])
def test_a_run_that_continues_without_its_newest_events_says_so(
    runs: dict[str, Path], tmp_path: Path, zeros: bool
) -> None:
    run = shutil.copytree(runs["killed"], tmp_path / "run")
    whole = (run / "events.jsonl").read_bytes()
    begin = whole.rindex(b"\n", 0, -1) + 1
    (run / "events.jsonl").write_bytes(whole[:begin] + bytes(len(whole) - begin) * zeros)
    record_run(run)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamageWarning)
        events = RunRecord.open(run).events()
    assert [event.details["file"] for event in events if event.kind == "record-damaged"] == ["events.jsonl"]
    assert sum(event.kind == "record-continued" for event in events) == 1


LOSSES = {
    "a changed byte": "responses.parquet", "no responses": "responses.parquet",
    "no manifest": "manifest.jsonl", "an empty manifest": "manifest.jsonl",
}  # fmt: skip


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[object], Path]:
    """The command that tracks a recording, and its run."""
    folder = tmp_path_factory.mktemp("recorded")
    log, run = write_csv(folder / "log.csv", signals()), folder / "run"
    track = ["run", log, "--excitation", "w", "--input", "u", "--output", "y", "--lines", "50,100,200"]
    track = [*track, "--window", 100, "--out", run]
    assert livebode(*track).code == 0
    return track, run


def lose(run: Path, loss: str) -> None:
    file = run / LOSSES[loss]
    if loss == "a changed byte":
        data = bytearray(file.read_bytes())
        data[len(data) // 3] ^= 1
        file.write_bytes(data)
    elif loss == "an empty manifest":
        file.write_bytes(b"")
    else:
        file.unlink()


@pytest.mark.parametrize("loss", LOSSES)
def test_a_run_of_which_no_response_is_left_names_the_file_and_a_remedy_that_works(
    recorded: tuple[list[object], Path], tmp_path: Path, loss: str
) -> None:
    (track, whole), file = recorded, LOSSES[loss]
    run = shutil.copytree(whole, tmp_path / "run")
    lose(run, loss)
    remedy = "track the recording again with `livebode run … --force`, or restore the file"
    sentence = f"{file} of {str(run)!r} is damaged or missing, and no rows of responses are left; {remedy}"
    out = ("--out", tmp_path / "out")
    commands = (
        ("fit", run), ("margins", run), ("learn", run, *out), ("report", run, *out), ("compare", run, whole, *out),
        ("validate", run, "--on", track[1]), ("export", run, "--to", "csv", *out),
        ("export", run, "--to", "csv", "--mean", *out), ("export", run, "--sql", "SELECT count(*) FROM responses"),
    )  # fmt: skip
    for command in commands:
        done = livebode(*command)
        assert (done.code, done.err.count(sentence)) == (2, 1), (command, done.err)
        assert "more periods" not in done.err
    with pytest.warns(DamageWarning), pytest.raises(RecordError, match="no rows of responses are left"):
        Run(run).average  # noqa: B018
    other = livebode("export", run, "--sql", "FROM responsess").err
    assert "query the tables of this run: events, single_events (option --sql)" in other
    assert livebode("export", run, "--sql", "SELECT 1").code == 0

    restored = shutil.copytree(run, tmp_path / "restored")
    shutil.copyfile(whole / file, restored / file)
    again = [run if value == whole else value for value in track]
    assert livebode(*again, "--force").code == 0
    for mended in (run, restored):
        done = livebode("export", mended, "--sql", "SELECT count(*) FROM responses", "--csv")
        assert (done.code, int(done.out.split()[1]) > 0) == (0, True), done.err
        assert not done.err


def test_damage_that_loses_no_row_is_no_reason_for_an_absent_table(
    recorded: tuple[list[object], Path], tmp_path: Path
) -> None:
    run = shutil.copytree(recorded[1], tmp_path / "run")
    lines = (run / "manifest.jsonl").read_bytes().splitlines(keepends=True)
    lines[-1] = lines[-1].replace(b"responses", b"responsex")
    (run / "manifest.jsonl").write_bytes(b"".join(lines))
    done = livebode("export", run, "--sql", "FROM parameters")
    assert "nothing is lost" in done.err
    assert "query the tables of this run: events, single_events, responses" in done.err


def test_a_run_without_run_json_is_read_from_the_copy_listed_replaced_and_deleted(
    recorded: tuple[list[object], Path], tmp_path: Path
) -> None:
    track, whole = recorded
    run = shutil.copytree(whole, tmp_path / "runs" / "run")
    (run / "run.json").unlink()
    done = livebode("export", run, "--sql", "SELECT count(*) FROM responses", "--csv")
    assert (done.code, int(done.out.split()[1]) > 0) == (0, True)
    assert f"{str(run / 'run.json')!r} is missing; its copy run-copy.json is read instead" in done.err
    assert runs_in(run.parent) == ["run"]
    assert entry(run).state == "finished"

    files = {path.name for path in whole.iterdir()}
    again = [*(run if value == whole else value for value in track), "--force"]
    (run / "mine.txt").write_text("mine")
    refused = livebode(*again)
    assert (refused.code, "files that livebode did not write: mine.txt" in refused.err) == (2, True)
    assert {path.name for path in run.iterdir()} == files - {"run.json"} | {"mine.txt"}
    (run / "mine.txt").unlink()
    assert livebode(*again).code == 0
    assert {path.name for path in run.iterdir()} == files

    (run / "run.json").unlink()
    deleted = delete(run)
    assert (deleted / "run-copy.json").exists()
    (deleted / "run-copy.json").unlink()
    neither = livebode("fit", deleted)
    assert (neither.code, "it has no run.json" in neither.err) == (2, True)


def test_a_killed_run_without_run_json_continues(runs: dict[str, Path], tmp_path: Path) -> None:
    run = shutil.copytree(runs["killed"], tmp_path / "run")
    (run / "run.json").unlink()
    record_run(run)
    assert RunRecord.open(run).finished
    assert len(RunRecord.open(run).responses()) == len(RunRecord.open(runs["segments"]).responses())
