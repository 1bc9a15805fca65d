"""A lake removes data files that its tables do not need, and nothing else."""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pytest

from livebode.core import ArchiveError, DamageWarning
from livebode.locations import Url, opened, write_whole
from livebode_plant.fleet.fleet_settings import SinkSection
from livebode_plant.fleet.sink_tables import SinkTables
from livebode_plant.lake import TABLES, Key, Lake, compact
from tests.support.archives import coordinator, write_archive
from tests.support.errors import refused
from tests.support.object_storage import BUCKET, object_storage

KEYS = [Key(f"{number:064x}", "0123456789abcdef") for number in range(5)]


def rows(name: str, key: Key) -> pa.Table:
    """A row of a table with this key and nothing else."""
    return pa.Table.from_pylist([key._asdict()], schema=TABLES[name].schema)


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    """A lake in the directory of a project, beside runs of the same name as a table; all of it is a month old."""
    lake = Lake(str(tmp_path))
    for name in ("runs", "quantities"):
        for key in KEYS[:4]:
            lake.add_rows(name, rows(name, key))
    (tmp_path / "runs" / "monday").mkdir(parents=True)
    (tmp_path / "runs" / "monday" / "responses.parquet").write_text("years of work")
    return lake


def files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if "_delta_log" not in path.parts)


def aged(folder: Path) -> None:
    at_s = time.time() - 30 * 86_400
    for path in (folder, *folder.rglob("*")):
        os.utime(path, (at_s, at_s), follow_symlinks=False)


def test_a_file_that_no_table_has_is_removed_after_a_week_and_the_project_is_not_touched(
    lake: Lake, tmp_path: Path
) -> None:
    table = tmp_path / "tables" / "runs"
    own = next(table.glob("rows-*.parquet"))
    left = table / f"rows-{'0' * 64}.parquet"
    shutil.copy(own, left)
    removed = {one.table: one.removed for one in compact(lake)}
    assert left.exists()
    assert set(removed.values()) == {0}
    aged(tmp_path)
    assert {one.table: one.removed for one in compact(lake)} == removed | {"runs": 1}
    assert not left.exists()
    assert own.exists()  # replaced now, and a reader may use it
    assert (tmp_path / "runs" / "monday" / "responses.parquet").exists()
    assert sorted(lake.read("runs")["content"].to_pylist()) == [key.content for key in KEYS[:4]]


def link(place: Path) -> None:
    (place / "link").symlink_to(place.parent.parent / "outside")


def linked_table(place: Path) -> None:
    place.rename(place.parent.parent / "elsewhere")
    place.symlink_to(place.parent.parent / "elsewhere")


def linked_log(place: Path) -> None:
    (place / "_delta_log").rename(place.parent.parent / "log")
    (place / "_delta_log").symlink_to(place.parent.parent / "log")


def folder(place: Path) -> None:
    (place / "2026").mkdir()
    (place / "2026" / "thesis.tex").write_text("years of work")


def similar(place: Path) -> None:
    (place / "part-00000-backup.parquet").write_text("years of work")


def pipe(place: Path) -> None:
    os.mkfifo(place / f"rows-{'0' * 64}.parquet")


CHANGES = (link, linked_table, linked_log, folder, similar, pipe)


@pytest.mark.parametrize("change", CHANGES)
def test_a_directory_with_anything_else_is_refused_by_everybody(
    lake: Lake, tmp_path: Path, change: Callable[[Path], None]
) -> None:
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "victim").write_text("years of work")
    change(tmp_path / "tables" / "runs")
    aged(tmp_path)
    before = files(tmp_path)
    archive = write_archive(tmp_path.parent / "archive", 1)
    for call in (
        lambda: compact(Lake(lake.url)),
        coordinator(archive, lake=lake.url).run,
        lambda: SinkTables(SinkSection(lake=lake.url)).resume(0.0),
    ):
        with refused(ArchiveError, "foreign-files", table="runs"):
            call()
    shutil.rmtree(archive.parent)
    assert files(tmp_path) == before


def test_a_data_file_by_its_name_alone_is_not_removed(lake: Lake, tmp_path: Path) -> None:
    mine = tmp_path / "tables" / "runs" / f"{KEYS[4].content}-{KEYS[4].recipe}.parquet"
    mine.write_text("years of work")
    aged(tmp_path)
    with refused(ArchiveError, "foreign-files", files=[mine.name]):
        compact(lake)
    assert mine.exists()


@pytest.mark.parametrize("path", ["../victim", "%2e%2e/victim", "deep/x.parquet", "/etc/hostname", "thesis.parquet"])
def test_a_log_that_lists_files_elsewhere_is_refused(lake: Lake, tmp_path: Path, path: str) -> None:
    log = tmp_path / "tables" / "runs" / "_delta_log"
    version = int(max(log.glob("*.json")).stem) + 1
    added = {"path": path, "partitionValues": {}, "size": 1, "modificationTime": 0, "dataChange": True}
    removed = {"path": path, "deletionTimestamp": 1, "dataChange": True}
    for number, line in enumerate(({"remove": removed}, {"add": added})):
        (log / f"{version + number:020}.json").write_text(json.dumps(line))
    (tmp_path / "tables" / "victim").write_text("years of work")
    aged(tmp_path)
    before = files(tmp_path / "tables" / "runs")
    with pytest.warns(DamageWarning, match="table runs"):
        compact(lake)  # the other tables are compacted
    assert files(tmp_path / "tables" / "runs") == before
    assert (tmp_path / "tables" / "victim").read_text() == "years of work"


def test_objects_of_somebody_else_are_not_removed_and_unused_ones_are() -> None:
    with object_storage():
        lake = Lake(f"s3://{BUCKET}/lake")
        lake.add_rows("runs", rows("runs", KEYS[0]))
        place = Url(f"s3://{BUCKET}/lake/tables/runs")
        system, inside = opened(place)
        own = next(name for name in system.ls(inside) if name.endswith(".parquet"))
        left = f"rows-{'0' * 64}.parquet"
        system.copy(own, f"{inside}/{left}")
        assert lake.remove_unused("runs", 0) == 1
        assert not system.exists(f"{inside}/{left}")
        for name in ("thesis.tex", "deep/er.parquet", left):
            write_whole(place / name, b"years of work")
            with refused(ArchiveError, "foreign-files", table="runs"):
                lake.remove_unused("runs", 0)
            assert system.cat_file(f"{inside}/{name}") == b"years of work"
            system.rm_file(f"{inside}/{name}")
        assert len(lake.read("runs")) == 1
