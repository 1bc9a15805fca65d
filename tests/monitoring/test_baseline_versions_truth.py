"""A baseline says what it replaced, earlier versions are retained, and a run names the version that judged it."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.analysis import learn
from livebode.configuration import Axis
from livebode.core import BaselineError, OutputError
from livebode.monitoring import Baseline, file_of, retained_file
from livebode.runtime import Destination, run
from tests.support.command import WINDOW, livebode, signals
from tests.support.errors import refused
from tests.support.monitored import small_baseline


def recorded(folder: Path, seed: int, unit: str = "rad/s", **sections: object) -> Path:
    """The run of a small machine at standstill, learned from in a moment."""
    columns = signals(6000, seed=seed)
    units = {"t": "s", "w": "A", "u": "A", "y": unit}
    fields = [pa.field(name, pa.float64(), metadata={"unit": units[name]} if units[name] else None) for name in columns]
    log = folder / f"log-{seed}.parquet"
    pq.write_table(pa.table([pa.array(values) for values in columns.values()], schema=pa.schema(fields)), log)
    data = {
        "source": {"log": str(log)},
        "signals": {"excitation": "w", "input": "u", "output": "y"},
        "lines": {"frequencies": "50,100,200", "window": WINDOW},
        "tracking": {"hop": 20},
    }
    out = folder / f"run-{seed}"
    run(Axis.of(data | sections, "the test"), Destination(out, lambda *_: None))
    return out


def versions(*seeds: int) -> list[Baseline]:
    """Baselines with different content."""
    first = small_baseline()
    return [replace(first, hop=first.hop * seed, runs=(f"runs/{seed}",), learned=f"2026-0{seed}-01") for seed in seeds]


def test_an_id_is_that_of_what_was_learned(tmp_path: Path) -> None:
    first = small_baseline()
    first.save(tmp_path / "a.json")
    assert len(first.id) == 16
    same = replace(first, runs=("elsewhere",), learned="2026-01-01", reason="new belt", remark="a remark")
    assert Baseline.load(tmp_path / "a.json").id == same.id == first.id
    table = first.tables[0]
    others = (
        replace(first, hop=first.hop + 1),
        replace(first, estimator="direct"),
        replace(first, machine=None),
        replace(first, tables=(replace(table, mean=table.mean * (1 + 1e-15)),)),
    )
    assert len({first.id, *(other.id for other in others)}) == 1 + len(others)


def test_a_next_version_retains_the_one_before_it_to_the_byte(tmp_path: Path) -> None:
    path = tmp_path / "healthy.json"
    one, two, three = versions(1, 2, 3)
    replace(one, reason="commissioning").save(path)
    first = path.read_bytes()
    two.save_version(path, "new belt")
    second = path.read_bytes()
    newest = three.save_version(path)
    assert [version.reason for version in newest.history] == ["new belt", "commissioning"]
    assert [version.runs for version in newest.history] == [("runs/2",), ("runs/1",)]
    data = json.loads(path.read_text("utf-8"))
    assert (data["id"], data["replaces"], data["version"]) == (three.id, two.id, 5)
    assert retained_file(path, one.id).read_bytes() == first
    assert retained_file(path, two.id).read_bytes() == second
    assert sorted(path.parent.iterdir()) == [tmp_path / "healthy.history", path]
    assert (file_of(path, two.id), file_of(path, three.id)) == (retained_file(path, two.id), path)


def test_a_baseline_that_judges_alike_replaces_nothing(tmp_path: Path) -> None:
    path = tmp_path / "healthy.json"
    (one,) = versions(1)
    one.save(path)
    before = path.read_bytes()
    assert replace(one, learned="2026-09-01").save_version(path, "again").learned == "2026-01-01"
    assert (path.read_bytes(), [*tmp_path.iterdir()]) == (before, [path])


def test_a_copy_of_the_file_alone_has_the_history_without_the_files(tmp_path: Path) -> None:
    path = tmp_path / "healthy.json"
    one, two = versions(1, 2)
    one.save(path)
    two.save_version(path, "new belt")
    (tmp_path / "office").mkdir()
    copy = shutil.copy(path, tmp_path / "office")
    shown = livebode("learn", "--history", copy).out
    assert shown.count("its file is not here") == 1
    assert "2 versions, the newest first" in shown
    found = json.loads(livebode("learn", "--history", path, "--json").out)["versions"]
    assert [version["id"] for version in found] == [two.id, one.id]
    assert [version["file"] for version in found] == [str(path), str(retained_file(path, one.id))]


def test_a_baseline_that_was_edited_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "healthy.json"
    small_baseline().save(path)
    data = json.loads(path.read_text("utf-8"))
    path.write_text(json.dumps(data | {"hop": data["hop"] + 1}), "utf-8")
    with pytest.raises(BaselineError, match="it was changed after it was learned; learn it again"):
        Baseline.load(path)


def test_a_version_that_cannot_be_retained_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "healthy.json"
    one, two = versions(1, 2)
    one.save(path)
    (tmp_path / "healthy.history").write_text("a file is in the way")
    with pytest.raises(OutputError):
        two.save_version(path, "new belt")
    assert Baseline.load(path).id == one.id


def test_learn_replaces_only_with_a_reason_and_a_run_names_its_version(tmp_path: Path) -> None:
    first, second, path = recorded(tmp_path, 1), recorded(tmp_path, 2), tmp_path / "healthy.json"
    assert livebode("learn", first, "--out", path, "--reason", "commissioning").code == 0
    old = Baseline.load(path)
    refusal = livebode("learn", second, "--out", path)
    assert (refusal.code, "replace it as its next version with --reason TEXT" in refusal.err) == (2, True)
    third = recorded(tmp_path, 3, monitoring={"baseline": str(path)})
    compared = json.loads((third / "run.json").read_text("utf-8"))["monitoring"]
    learned = livebode("learn", second, "--out", path, "--reason", "new belt", "--json")
    new = json.loads(learned.out)
    assert (new["replaces"], new["reason"], Baseline.load(path).id) == (old.id, "new belt", new["id"])
    assert compared["baseline_id"] == old.id
    assert Baseline.load(file_of(path, compared["baseline_id"])).runs == (str(first),)
    again = livebode("learn", second, "--out", path, "--force")
    assert f"version {new['id']}, is unchanged" in again.out
    shown = livebode("learn", "--history", path).out
    assert [f"reason: {reason}" in shown for reason in ("new belt", "commissioning")] == [True, True]
    assert livebode("learn", first, "--history", path).code == 2


def test_runs_with_and_without_a_unit_are_not_learned_together(tmp_path: Path) -> None:
    with_unit, without = recorded(tmp_path, 1), recorded(tmp_path, 2, unit="")
    with refused(BaselineError, "runs-differ", what="the unit of the response"):
        learn([with_unit, without])
