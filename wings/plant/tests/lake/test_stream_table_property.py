"""A table whose rows come from a stream: however many write, in whatever parts, each row is there once."""

from __future__ import annotations

import datetime as dt
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode_plant.lake import TABLES, Lake, StreamTable
from tests.support.object_storage import BUCKET, object_storage

FIRST = dt.datetime(2026, 11, 20, tzinfo=dt.UTC)
EVERYTHING = pc.scalar(True)


def rows(first: int, last: int, hours: float = 1.0) -> pa.Table:
    """An event for each message, some hours after each other."""
    found = []
    for number in range(first, last + 1):
        logged = FIRST + dt.timedelta(hours=hours * number)
        found.append({"day": logged.date(), "axis": f"x{number % 3}", "logged": logged, "sample": number})
    return pa.Table.from_pylist(found, TABLES["fleet_events"].schema)


def until(last: int) -> Callable[[int], pa.Table]:
    return lambda position: rows(position + 1, last)


def numbers(lake: Lake, since: dt.date = dt.date.min) -> list[int]:
    found = StreamTable(lake, "fleet_events").read(["sample"], EVERYTHING, since)["sample"].to_pylist()
    return sorted(found)


def test_two_writers_of_one_stream_store_each_row_once(tmp_path: Path) -> None:
    def write(step: int) -> None:
        table = StreamTable(Lake(str(tmp_path)), "fleet_events")
        for last in range(step, 31, step):
            table.append("a", last, until(last), {"a first": last - 1})

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(write, (3, 5)))
    lake = Lake(str(tmp_path))
    assert numbers(lake) == list(range(1, 31))
    table = StreamTable(lake, "fleet_events")
    assert (table.position("a"), table.position("a first"), table.position("b")) == (30, 29, 0)
    assert len(lake.read("fleet_events", ["sample"], pc.field("sample") > 25)) == 5


@settings(max_examples=4, deadline=None)
@given(st.lists(st.integers(1, 40), min_size=1, max_size=5), st.integers(0, 3))
def test_rows_of_old_days_are_deleted_and_the_others_joined_whatever_the_parts(parts: list[int], days: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        lake = Lake(folder)
        table = StreamTable(lake, "fleet_events")
        for last in parts:
            table.append("a", last, until(last))
        before = FIRST.date() + dt.timedelta(days=days)
        table.delete_before(before)
        table.join_before(dt.date(2030, 1, 1))
        expected = [number for number in range(1, max(parts) + 1) if FIRST + dt.timedelta(hours=number) >= at(before)]
        assert numbers(lake) == expected
        assert numbers(Lake(folder), before + dt.timedelta(days=1)) == [
            number for number in expected if FIRST + dt.timedelta(hours=number) >= at(before) + dt.timedelta(days=1)
        ]
        assert table.position("a") == max(parts)
        assert table.join_before(dt.date(2030, 1, 1)) == 0
        table.append("a", 50, until(50))
        assert numbers(lake)[-1] == 50


def at(day: dt.date) -> dt.datetime:
    return dt.datetime.combine(day, dt.time(), dt.UTC)


def test_rows_of_a_file_that_was_joined_remain_for_readers_of_the_older_version(tmp_path: Path) -> None:
    lake = Lake(str(tmp_path))
    table = StreamTable(lake, "fleet_events")
    for last in (2, 4):
        table.append("a", last, until(last))
    assert table.join_before(dt.date(2030, 1, 1)) == 2
    assert table.remove_unused() == 0
    assert numbers(lake) == [1, 2, 3, 4]


def test_rows_in_object_storage_are_appended_once_deleted_and_joined() -> None:
    with object_storage():
        url = f"s3://{BUCKET}/fleet"
        table, other = (StreamTable(Lake(url), "fleet_events") for _ in range(2))
        for last in (10, 30):
            table.append("a", last, until(last))
            other.append("a", last + 2, until(last + 2))
        assert numbers(Lake(url)) == list(range(1, 33))
        assert table.delete_before(FIRST.date() + dt.timedelta(days=1)) == 3
        assert table.join_before(dt.date(2030, 1, 1)) == 2
        assert other.position("a") == 32
        assert numbers(Lake(url)) == list(range(24, 33))
        assert sorted(Lake(url).read("fleet_events", ["sample"])["sample"].to_pylist()) == list(range(24, 33))
