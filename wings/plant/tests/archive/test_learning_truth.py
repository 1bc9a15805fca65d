"""Baselines from a lake: the same as from run directories, and what makes runs unfit to learn from."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import livebode
from livebode import ArchiveError
from livebode.monitoring import Baseline
from livebode.runtime import Destination, run
from livebode_plant.archive.archive_settings import ArchiveSettings
from livebode_plant.archive.learning import healthy_runs, learn_of_lake
from livebode_plant.lake import Lake, compact, runs_of
from livebode_plant.trending import Selection
from livebode_plant.trending.machine_year import START_S, MachineYear
from tests.support.archives import RECIPE, loop, write_recording
from tests.support.command import livebode as command
from tests.support.command import write_parquet
from tests.support.halls import hall
from tests.support.monitored import recorded

_MOVING = """
[signals]
excitation = "w"
input = "u"
output = "velocity"
schedule = "x"
[lines]
frequencies = "20:140:20"
window = 400
[tracking]
hop = 80
"""


def write_toml(folder: Path, recipe: str) -> Path:
    (folder / "recipe.toml").write_text(recipe)
    path = folder / "archive.toml"
    path.write_text(
        'inputs = ["plant/{machine}/*.parquet"]\nrecipe = "recipe.toml"\nlake = "lake"\n'
        'baselines = "baselines/{machine}.json"\n'
    )
    return path


def rigid(folder: Path, machine: int, seeds: range, changed: int = 0) -> None:
    """Recordings of a rigid axis at standstill, of 40 periods each."""
    own = folder / "plant" / f"press-{machine}"
    own.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        write_recording(own / f"{seed}.parquet", 100 * machine + seed, periods=40, machine=10 * machine + changed)


def from_directories(archive: Path, recordings: list[Path]) -> Baseline:
    """What `livebode learn` learns from run directories of these recordings."""
    axis, runs = next(iter(ArchiveSettings.read(archive).axes().values())), []
    for path in recordings:
        runs.append(archive.parent / "runs" / path.stem)
        own = axis.model_copy(update={"source": axis.source.model_copy(update={"log": path})})
        run(own, Destination(runs[-1], lambda *_: None))
    return livebode.learn(runs)


def test_a_machine_at_standstill_is_learned_from_the_lake_alone(tmp_path: Path) -> None:
    archive = write_toml(tmp_path, RECIPE)
    rigid(tmp_path, 1, range(3))
    lake = loop(archive, str(tmp_path / "lake"))
    expected = from_directories(archive, sorted(tmp_path.glob("plant/*/*.parquet")))
    shutil.rmtree(tmp_path / "plant")
    found = learn_of_lake(lake, runs_of(lake))
    assert found.baseline.id == expected.id
    assert [table.what for table in found.baseline.tables] == ["lines", "parameters"]
    assert (found.recordings, found.size_bytes, found.responses) == (0, 0, 120)
    compact(lake)
    assert learn_of_lake(Lake(lake.url), runs_of(lake)).baseline.id == expected.id


def test_a_moving_machine_is_learned_from_recordings_at_any_place_where_they_are_unchanged(tmp_path: Path) -> None:
    archive = write_toml(tmp_path, _MOVING)
    own = tmp_path / "plant" / "press-1"
    own.mkdir(parents=True)
    block = recorded((0.12, 0.36, 0.15), seed=60)
    write_parquet(own / "b.parquet", {"t": np.arange(len(block)) / 4000} | {n: block[n] for n in block.names})
    shutil.copy(own / "b.parquet", own / "a.parquet")
    lake = loop(archive, str(tmp_path / "lake"))
    expected = from_directories(archive, [own / "b.parquet"])
    assert expected.machine is not None
    (own / "a.parquet").write_bytes(b"another recording")
    (one,) = runs_of(lake)
    assert str(one.row["url"]).endswith("a.parquet")
    found = learn_of_lake(lake, [one])
    assert found.baseline.id == expected.id
    assert (found.recordings, found.size_bytes) == (1, (own / "b.parquet").stat().st_size)
    assert found.baseline.runs == (f"{own / 'a.parquet'}#{one.key.content[:16]}",)
    (own / "b.parquet").unlink()
    with pytest.raises(ArchiveError, match="is not there as it was tracked") as caught:
        learn_of_lake(lake, [one])
    assert caught.value.code == "archive.recording-absent"


def test_each_machine_is_judged_by_its_own_baseline_and_alarms_are_not_learned(tmp_path: Path) -> None:
    archive, lake = write_toml(tmp_path, RECIPE), str(tmp_path / "lake")
    for machine in (1, 2):
        rigid(tmp_path, machine, range(3))
    loop(archive, lake)
    learned = command("archive", "learn", archive, "--each")
    assert (learned.code, learned.err) == (0, "")
    assert "press-1: 3 runs, 120 responses of the lake" in learned.out
    assert sorted(path.name for path in tmp_path.glob("baselines/*")) == ["press-1.json", "press-2.json"]

    rigid(tmp_path, 1, range(3, 4))
    rigid(tmp_path, 2, range(3, 4), changed=20)
    loop(archive, lake)
    rows = {
        one["machine"]: (one["runs"], one["judged"], one["alarming"])
        for one in json.loads(command("archive", "list", archive, "--json").out)["machines"]
    }
    assert rows == {"press-1": (4, 1, 0), "press-2": (4, 1, 1)}
    report = command("archive", "trend", archive, "--out", tmp_path / "hall", "--language", "de", "--json")
    alarms = json.loads(report.out)["alarms"]
    assert {alarm["axis"] for alarm in alarms} == {"press-2"}
    assert "1 Lauf hat einen Alarm gegenüber der Referenz seiner Maschine: press-2." in (
        tmp_path / "hall.html"
    ).read_text("utf-8")

    again = command("archive", "learn", archive, "--each", "--reason", "new gear")
    assert again.code == 2
    assert "press-2 may not have been healthy: 1 of 4 runs with an alarm (3.parquet" in again.err
    first = Baseline.load(tmp_path / "baselines" / "press-1.json")
    assert (first.reason, len(first.runs), len(first.history)) == ("new gear", 4, 1)
    assert len(Baseline.load(tmp_path / "baselines" / "press-2.json").runs) == 3
    for option in (("--exclude", "press-2/3.parquet"), ("--accept",)):
        out = tmp_path / f"{option[0]}.json"
        only = command("archive", "learn", archive, "--machine", "press-2", "--out", out, *option, "--json")
        assert only.code == 0, only.err
        (one,) = json.loads(only.out)["baselines"]
        assert len(one["runs"]) == (3 if option[0] == "--exclude" else 4)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "2 axes are selected (press-1, press-2)"),
        (("--each", "--out", "one.json"), "is that of several axes"),
        (("--each", "--out", "{axis}.json"), "has a level that is not known"),
        (("--machine", "press-3"), "the lake has no run of press-3"),
        (("--machine", "press-1", "--exclude", "z.parquet"), "the lake has no recording 'z.parquet'"),
        (("--machine", "press-1", "--since", "2999-01-01"), "the lake has no run of press-1"),
        (("--machine", "press-1", "--until", "1999-01-01"), "the lake has no run of press-1"),
        (("--machine", "press-1", "--out", "s3://a/b.json"), "is not a path on this computer"),
    ],
)
def test_what_cannot_be_learned_is_refused_with_its_reason(
    two_machines: Path, options: tuple[str, ...], said: str
) -> None:
    refused = command("archive", "learn", two_machines, *options)
    assert (refused.code, said in refused.err) == (2, True), refused.err


@pytest.fixture(scope="module")
def two_machines(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("two")
    archive = write_toml(folder, RECIPE)
    for machine in (1, 2):
        rigid(folder, machine, range(1))
    loop(archive, str(folder / "lake"))
    return archive


def test_a_jump_is_a_doubt_unless_its_runs_are_left_out(tmp_path: Path) -> None:
    year = MachineYear(jump=-6.0, change_month=6.0)
    lake = hall(tmp_path / "lake", {"A/L1/M1/x": year, "A/L1/M2/x": MachineYear()})
    jumped, steady = healthy_runs(lake, Selection())
    assert not steady.doubts
    (doubt,) = jumped.doubts
    assert "belt stiffness of A/L1/M1/x fell by" in doubt
    with pytest.raises(ArchiveError, match="fell by"):
        jumped.check()
    half_s = START_S + 0.5 * 365.25 * 86400
    later = [run.key.content for run in jumped.runs if run.recorded_from and run.recorded_from.timestamp() > half_s]
    (before,) = healthy_runs(lake, Selection(below="A/L1/M1", excluded=later))
    assert not before.doubts
