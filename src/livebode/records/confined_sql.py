"""SQL on some tables and nothing else, by DuckDB (extra `query`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from livebode.core import UsageError, not_installed
from livebode.dataclass import dataclass

# It reads only the given tables and writes nothing, so that an untrusted query can be run.
_CONFINED = (
    "SET memory_limit = '2GB'",
    "SET temp_directory = ''",
    "SET python_enable_replacements = false",
    "SET enable_external_access = false",
    "SET lock_configuration = true",
)


@dataclass(frozen=True)
class QueryResult:
    """The rows of a query; `more`: there are others that were omitted."""

    columns: tuple[str, ...]
    rows: list[tuple[Any, ...]]
    more: bool


@dataclass(frozen=True)
class QueryTables:
    """What a query can read.

    Attributes
    ----------
    of
        Whose tables they are, for messages: "run".
    names
        Of the tables that are shown where it is not known which ones a query reads.
    show
        Registers those of some tables that exist in a database.
    known
        Names of the tables that exist.
    """

    of: str
    names: Sequence[str]
    show: Callable[[Any, set[str]], None]
    known: Callable[[], list[str]]


def answer_query(sql: str, rows_max: int, tables: QueryTables) -> QueryResult:
    """The first rows of a query.

    Raises
    ------
    ExtraError
        If DuckDB is not installed.
    UsageError
        If the query cannot be run.
    """
    try:
        import duckdb
    except ImportError:
        raise not_installed("DuckDB is not installed", package="duckdb", extra="query") from None
    with duckdb.connect(":memory:") as database:
        try:
            asked = {str(name).lower() for name in database.get_table_names(sql)} or set(tables.names)
        except duckdb.Error:
            asked = set(tables.names)  # it is not a SELECT, and is rejected below
        tables.show(database, asked)
        for setting in _CONFINED:
            database.execute(setting)
        try:
            found = _answered(database, sql, rows_max)
        except duckdb.Error as error:
            # After the sentence the message repeats the query, with an arrow.
            sentence = " ".join(str(error).split("\n\n")[0].split())
            known = tables.known()
            raise UsageError(
                "query-rejected",
                f"the query cannot be run: {sentence}",
                f"query the tables of this {tables.of}: {', '.join(known)}",
                argument="sql",
                reason=sentence,
                tables=known,
            ) from None
    if found is None:
        known = tables.known()
        raise UsageError(
            "missing", "the query is empty", f"write SQL on {', '.join(known)}", argument="sql", tables=known
        )
    return found


def _answered(database: Any, sql: str, rows_max: int) -> QueryResult | None:
    """The result; None if the SQL is empty. Ctrl-C ends the query."""

    def ask() -> QueryResult | None:
        cursor = database.execute(sql)
        if cursor is None:
            return None
        columns, rows = tuple(column[0] for column in cursor.description or ()), cursor.fetchmany(rows_max + 1)
        return QueryResult(columns, rows[:rows_max], len(rows) > rows_max)

    # In another thread, because DuckDB checks for signals only occasionally.
    with ThreadPoolExecutor(1) as worker:
        running = worker.submit(ask)
        try:
            return running.result()
        except KeyboardInterrupt:
            database.interrupt()
            raise
