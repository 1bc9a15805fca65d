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

from livebode.core import DamageWarning
from livebode.records import RunRecord
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
