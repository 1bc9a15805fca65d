"""SQL on the tables of a lake, by DuckDB (extra `query`)."""

from __future__ import annotations

from typing import Any

from livebode.core import ArchiveError
from livebode.records import QueryResult, QueryTables, answer_query
from livebode_plant.lake.lake import Lake
from livebode_plant.lake.schemas import TABLES

_COMPLETE = " SEMI JOIN _runs USING (content, recipe)"


def query_lake(lake: Lake, sql: str, rows_max: int) -> QueryResult:
    """The first rows of a query on the tables of a lake, without rows of results that are not complete.

    Parameters
    ----------
    lake
        The lake; the query uses what is committed at its start.
    sql
        DuckDB's SQL. It can read these tables and no files.
    rows_max
        Most rows to return.

    Raises
    ------
    ExtraError
        If DuckDB is not installed.
    UsageError
        If the query cannot be run.
    ArchiveError
        If the lake cannot be read, or has no table yet.
    """

    def show(database: Any, asked: set[str]) -> None:
        for name in [name for name in TABLES if name in asked | {"runs"}]:
            if (rows := lake.lazy_rows(name)) is not None:
                database.register(f"_{name}", rows)
                complete = _COMPLETE if _is_of_results(name) else ""
                database.execute(f"CREATE VIEW {name} AS SELECT _{name}.* FROM _{name}{complete}")

    def known() -> list[str]:
        return [name for name in TABLES if lake.exists(name)]

    if not known():
        raise ArchiveError(
            "lake-unusable",
            f"the lake {lake.url!r} has no table yet",
            "track recordings first (livebode archive run), or check its address",
            lake=lake.url,
        )
    try:
        return answer_query(sql, rows_max, QueryTables("lake", tuple(TABLES), show, known))
    finally:
        lake.report_damage()


def _is_of_results(name: str) -> bool:
    """Whether a table has rows of results that may not be complete."""
    columns = TABLES[name].schema.names
    return name not in ("runs", "quarantine") and "content" in columns and "recipe" in columns
