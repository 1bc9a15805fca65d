"""A lake with every table, one of whose files is damaged, and what every reader must still find in it."""

from __future__ import annotations

import shutil
import warnings
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pyarrow as pa
from deltalake import DeltaTable

from livebode.core import ArchiveError, DamageWarning
from livebode_plant.lake import TABLES, DataFile, Key, Lake, StreamTable, compact
from livebode_plant.lake.data_file import ResultFileWriter
from livebode_plant.lake.query import query_lake
from tests.support.file_damage import damage

_KEYS = [Key(f"{number:064x}", f"{number:016x}") for number in range(4)]
_DAY = date(2026, 1, 2)


def make_lake(folder: Path) -> Lake:
    """Every table with several files; some of them joined, some with a checkpoint of the log."""
    lake, rng = Lake(str(folder / "lake")), np.random.default_rng(7)
    for number, key in enumerate(_KEYS):
        for name, table in sorted(TABLES.items(), key=lambda one: one[0] == "runs"):
            own = _rows(table.schema, key, rng).slice(0, 1 if table.key else None)
            if table.days:
                StreamTable(lake, name).append("stream", number + 1, partial(_same, own))
            elif table.key:
                lake.add_rows(name, own)
            else:
                lake.add_files(name, [write_data_file(lake, name, key, own)])
        if number == 1:
            compact(lake)
            for name in ("responses", "fleet_events", "files"):
                DeltaTable(f"{lake.url}/tables/{name}").create_checkpoint()
    return lake


def _same(rows: pa.Table, _: int) -> pa.Table:
    return rows


def _rows(schema: pa.Schema, key: Key, rng: np.random.Generator) -> pa.Table:
    rows = [{field.name: _value(field.type, rng) for field in schema} for _ in range(3)]
    own: dict[str, Any] = key._asdict() | {"day": _DAY, "url": key.content, "log": key.content, "livebode": "1"}
    rows = [row | {name: own[name] for name in own if name in row} for row in rows]
    return pa.Table.from_pylist(rows, schema=schema)


def _value(kind: pa.DataType, rng: np.random.Generator) -> Any:
    number = int(rng.integers(1, 1000))
    if pa.types.is_list(kind):
        return [_value(kind.value_type, rng) for _ in range(4)]
    if pa.types.is_map(kind):
        return [(str(number), rng.standard_normal())]
    if pa.types.is_string(kind):
        return str(number)
    if pa.types.is_floating(kind):
        return float(np.float32(rng.standard_normal()))
    if pa.types.is_timestamp(kind):
        return datetime(2026, 1, 2, tzinfo=UTC) + timedelta(seconds=number)
    if pa.types.is_date(kind):
        return _DAY
    return number % 2 == 0 if pa.types.is_boolean(kind) else number


@dataclass(frozen=True)
class Found:
    """Rows of a table as texts, and the sentence about its damage."""

    rows: Counter[str]
    sentence: str


def found_in(url: str, tables: Iterable[str]) -> dict[str, Found]:
    """What `Lake.read` gives of tables."""
    lake, found = Lake(url), {}
    for name in tables:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", DamageWarning)
            try:
                rows = Counter(map(str, lake.read(name).to_pylist()))
                position = StreamTable(lake, name).position("stream") if TABLES[name].days else 0
                rows[f"position {position}"] += 1
            except ArchiveError as error:
                if error.code != "archive.lake-damaged":
                    raise
                found[name] = Found(Counter(), str(error))
                continue
        found[name] = Found(rows, " ".join(str(one.message) for one in caught))
    return found


def check_lake(
    lake: Lake, before: dict[str, Found], folder: Path, rng: np.random.Generator, kind: str
) -> tuple[str, bool]:
    """Damage a file of a copy and read it: which kind of file it was, and whether the damage was named."""
    table = list(TABLES)[rng.integers(len(TABLES))]
    others = [name for name in rng.permutation(list(TABLES)) if name != table][:2]
    other = folder / "damaged"
    shutil.rmtree(other, ignore_errors=True)
    for name in {table, "runs", "quantities", *others}:
        shutil.copytree(Path(lake.url) / "tables" / name, other / "tables" / name)
    file = damage(other / "tables" / table, rng, kind)
    after, where = found_in(str(other), [table, *others]), (table, file, kind)
    assert all(after[one] == before[one] for one in others), where
    assert after[table].rows == before[table].rows or after[table].sentence, where
    assert after[table].rows <= before[table].rows, where
    assert not after[table].sentence or table in after[table].sentence, where
    if table not in ("runs", "quantities"):
        rows = query_lake(Lake(str(other)), "SELECT * FROM quantities", 1000).rows
        assert len(rows) == sum(before["quantities"].rows.values()) - 1
    return "log" if file.startswith("_delta_log") else "data file", bool(after[table].sentence)


def write_data_file(lake: Lake, table: str, key: Key, rows: pa.Table) -> DataFile:
    """Put the rows of one result, without the key's columns, in the directory of a table."""
    with TemporaryDirectory() as folder, ResultFileWriter(Path(folder), table, key) as writer:
        writer.write(rows)
        file = writer.finish()
        lake.store(file, writer.content)
    return file
