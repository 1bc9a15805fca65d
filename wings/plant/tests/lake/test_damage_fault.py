"""Any file of a lake is damaged: it is named, no value differs, and every other table is read.

`make damage` does it many more times.
"""

from __future__ import annotations

import os
import shutil
import warnings
from collections import Counter
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from livebode.core import ArchiveError, DamageWarning
from livebode_plant.lake import TABLES, DataFile, Lake, compact
from livebode_plant.lake.query import query_lake
from tests.support.damaged_lake import check_lake, found_in, make_lake
from tests.support.file_damage import KINDS

FAULTS = int(os.environ.get("LIVEBODE_DAMAGE_FLIPS", "16"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    return make_lake(tmp_path_factory.mktemp("whole"))


def test_each_damage_of_a_lake_is_named_and_the_rest_is_read(whole: Lake, tmp_path: Path) -> None:
    rng = np.random.default_rng(34)
    before, kinds = found_in(whole.url, TABLES), Counter[tuple[str, str, str]]()
    assert not any(one.sentence for one in before.values())
    assert all(sum(one.rows.values()) > 3 for one in before.values())
    for number in range(FAULTS):
        kind = list(KINDS)[number % len(KINDS)]
        file, named = check_lake(whole, before, tmp_path, rng, kind)
        kinds[kind, file, "named" if named else "without effect"] += 1
    for (kind, file, effect), count in sorted(kinds.items()):
        print(f"lake {kind:6} {file:10} {count:5} {effect}")


def copied(whole: Lake, folder: Path) -> Path:
    return shutil.copytree(whole.url, folder / "lake")


def flip(file: Path, at: int) -> None:
    content = bytearray(file.read_bytes())
    content[at] ^= 4
    file.write_bytes(content)


def test_a_damaged_file_is_not_joined_with_others(whole: Lake, tmp_path: Path) -> None:
    path = copied(whole, tmp_path)
    own = [file.name for file in whole_files(whole, "responses") if file.key is not None]
    flip(path / "tables" / "responses" / own[0], 100)
    (path / "tables" / "quarantine" / "_delta_log" / f"{0:020}.json").write_bytes(b"")
    with pytest.warns(DamageWarning):
        compacted = {one.table: one for one in compact(Lake(str(path)))}
    assert {"quantities", "runs"} <= compacted.keys()
    left = {file.name for file in whole_files(Lake(str(path)), "responses")}
    assert own[0] in left
    assert len(left) == 2
    with pytest.warns(DamageWarning, match=own[0]):
        rows = Lake(str(path)).read("responses")
    assert rows.num_rows == whole.read("responses").num_rows - 3


def whole_files(lake: Lake, name: str) -> list[DataFile]:
    lake.opened(name)
    return list(lake.snapshot(name).files.values())


@pytest.mark.parametrize(
    "name",
    ["../x", "/etc/x", "file:///etc/x", "s3://hall/x", "%2e%2e%2fx", "a/x", "..%5cx", "x\\y", "rows-x\n", ""],
)
def test_a_file_outside_the_table_is_refused(tmp_path: Path, name: str) -> None:
    lake = Lake(str(tmp_path / "lake"))
    for table in ("runs", "fleet_events"):
        lake.created(table)
        day = date(2026, 1, 1) if TABLES[table].days else None
        lake.commit(table, [DataFile(table, f"{name}-{'0' * 64}.parquet", 100, 1, day)])
        with pytest.raises(ArchiveError, match="is not the name of a file in this table") as caught:
            Lake(lake.url).read(table)
        assert caught.value.code == "archive.lake-damaged"
        assert "\n" not in str(caught.value)


def test_rows_are_not_added_to_a_table_of_which_a_file_is_damaged(whole: Lake, tmp_path: Path) -> None:
    path = copied(whole, tmp_path)
    rows = Lake(str(path)).read("runs")
    for name in ("runs", "files"):
        for file in (path / "tables" / name).glob("*.parquet"):
            flip(file, 50)
    with pytest.raises(ArchiveError) as caught:
        Lake(str(path)).add_rows("runs", rows)
    assert caught.value.code == "archive.lake-damaged"
    with pytest.warns(DamageWarning, match="delete the directory tables/files: it is written again"):
        assert Lake(str(path)).add_rows("files", whole.read("files")) == 4
    with pytest.warns(DamageWarning):
        assert Lake(str(path)).read("files").num_rows == 4


def test_an_advisory_table_with_a_damaged_log_is_not_used(whole: Lake, tmp_path: Path) -> None:
    path = copied(whole, tmp_path)
    for log in (path / "tables" / "files" / "_delta_log").iterdir():
        log.write_bytes(b"\0" * 100)
    lake = Lake(str(path))
    with pytest.warns(DamageWarning, match="delete the directory tables/files"):
        assert lake.read("files").num_rows == 0
    assert lake.keys("files") == set()
    assert lake.add_rows("files", whole.read("files")) == 0
    shutil.rmtree(path / "tables" / "files")
    assert Lake(str(path)).add_rows("files", whole.read("files")) == 4


def test_a_query_names_what_is_damaged_among_the_tables_that_it_reads(whole: Lake, tmp_path: Path) -> None:
    path = copied(whole, tmp_path)
    (path / "tables" / "parameters" / "_delta_log" / f"{0:020}.json").write_bytes(b"")
    next((path / "tables" / "events").glob("part-*")).write_bytes(b"")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(query_lake(Lake(str(path)), "FROM runs", 9).rows) == 4
    with pytest.warns(DamageWarning, match="events/part-"):
        assert len(query_lake(Lake(str(path)), "FROM events", 99).rows) == 6
    with pytest.raises(ArchiveError, match="table parameters"):
        query_lake(Lake(str(path)), "FROM parameters", 9)
