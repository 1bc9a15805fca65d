"""The lake: what is written twice is there once, by whomever and whenever it is written."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pytest

from livebode import ArchiveError
from livebode_plant.lake import TABLES, Key, Lake, compact
from tests.support.damaged_lake import write_data_file


def rows(name: str, *keys: Key) -> pa.Table:
    """Rows of a table with these keys and nothing else."""
    return pa.Table.from_pylist([key._asdict() for key in keys], schema=TABLES[name].schema)


def events(count: int = 3) -> pa.Table:
    own = {"kind": "gap", "sample": 1, "time_s": 0.5, "message": "lost", "details": "{}"}
    return pa.Table.from_pylist([own] * count, schema=TABLES["events"].schema)


KEYS = [Key(f"{number:064x}", "0123456789abcdef") for number in range(4)]


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake(str(tmp_path / "lake"))


@pytest.mark.parametrize("name", TABLES)
def test_a_table_that_was_never_written_is_empty_with_its_columns(lake: Lake, name: str) -> None:
    assert lake.read(name).schema.names == TABLES[name].schema.names
    assert lake.read(name).num_rows == 0


def test_rows_with_a_key_that_is_there_are_not_added_again(lake: Lake) -> None:
    assert lake.add_rows("runs", rows("runs", *KEYS[:2])) == 2
    assert lake.add_rows("runs", rows("runs", *KEYS[1:])) == 2
    assert Lake(lake.url).add_rows("runs", rows("runs", *KEYS)) == 0
    assert sorted(lake.read("runs")["content"].to_pylist()) == [key.content for key in KEYS]


def test_processes_that_add_the_same_rows_at_the_same_time_add_them_once(lake: Lake) -> None:
    others = [Lake(lake.url) for _ in range(4)]
    with ThreadPoolExecutor() as pool:
        added = list(pool.map(lambda one: [one.add_rows("runs", rows("runs", key)) for key in KEYS], others))
    assert [sum(column) for column in zip(*added)] == [1] * len(KEYS)
    assert sorted(lake.read("runs")["content"].to_pylist()) == [key.content for key in KEYS]


def test_a_file_that_is_added_twice_is_read_once(lake: Lake) -> None:
    for one in (lake, Lake(lake.url)):
        one.add_files("events", [write_data_file(one, "events", KEYS[0], events())])
    assert lake.read("events").num_rows == 3


def test_a_file_of_a_result_that_counts_is_not_added(lake: Lake) -> None:
    lake.add_rows("runs", rows("runs", KEYS[0]))
    lake.add_files("events", [write_data_file(lake, "events", KEYS[0], events())])
    assert lake.read("events").num_rows == 0


def test_quantities_of_a_result_without_its_run_do_not_count(lake: Lake) -> None:
    lake.add_rows("quantities", rows("quantities", *KEYS))
    lake.add_rows("runs", rows("runs", KEYS[2]))
    assert lake.counted("quantities")["content"].to_pylist() == [KEYS[2].content]


def test_a_damaged_table_is_an_error_that_names_it(lake: Lake) -> None:
    lake.add_rows("runs", rows("runs", KEYS[0]))
    next((Path(lake.url) / "tables" / "runs" / "_delta_log").glob("*1.json")).write_text("{")
    with pytest.raises(ArchiveError, match="table runs") as caught:
        Lake(lake.url).read("runs")
    assert caught.value.code == "archive.lake-damaged"


def test_a_filter_on_any_column_finds_its_rows(lake: Lake) -> None:
    own = {**KEYS[0]._asdict(), "model": "two-mass", "name": "Keff", "value": 2.0}
    lake.add_rows("quantities", pa.Table.from_pylist([own], schema=TABLES["quantities"].schema))
    assert lake.read("quantities", ["value"], pc.field("name") == "Keff")["value"].to_pylist() == [2.0]
    assert lake.read("quantities", ["value"], pc.field("site").is_null()).num_rows == 1
    lake.add_files("events", [write_data_file(lake, "events", KEYS[0], events())])
    assert lake.read("events", where=pc.field("kind") == "gap").num_rows == 3
    assert lake.read("events", where=pc.field("content") == KEYS[1].content).num_rows == 0


@pytest.mark.parametrize("name", ["runs", "responses"])
def test_compaction_retains_the_values_of_every_row(lake: Lake, name: str) -> None:
    schema = TABLES[name].schema
    newest = schema.names[-1]
    for number, key in enumerate(KEYS[:2]):
        value = str(number) if pa.types.is_string(schema.field(newest).type) else [str(number)]
        own = pa.Table.from_pylist([key._asdict() | {newest: value}], schema=schema)
        if TABLES[name].key:
            lake.add_rows(name, own)
        else:
            lake.add_files(name, [write_data_file(lake, name, key, own)])
    lake.add_rows("runs", rows("runs", *KEYS[:2]))  # what does not count is not joined
    written = sorted(lake.read(name, [newest])[newest].to_pylist())
    assert len(written) == 2
    (joined,) = (one for one in compact(lake) if one.table == name)
    assert (joined.before, joined.after) == (2, 1)
    assert sorted(lake.read(name, [newest])[newest].to_pylist()) == written
