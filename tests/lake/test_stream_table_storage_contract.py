"""A table of a stream on S3: as in a directory, by conditional puts."""

from __future__ import annotations

import datetime as dt

from livebode.lake import Lake, StreamTable
from tests.lake.test_stream_table_property import FIRST, numbers, until
from tests.support.object_storage import BUCKET, object_storage


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
