"""docs/reference/formats.md states what the code writes."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
import pytest

from livebode.core import state
from livebode.records import PARAMETERS, RESPONSES, ColumnTable
from livebode.records.json_format import VERSIONS
from livebode.records.segments import frames
from livebode.records.segments.frames import COMMIT, FORMAT, ROWS, TABLE
from livebode.records.segments.journal import Journal
from livebode.version import __version__
from livebode_plant.lake.wide_responses import wide_schema
from tests.support.monitored import small_baseline

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/reference/formats.md").read_text("utf-8")
RUN_PAGE = (ROOT / "docs/reference/run-directory.md").read_text("utf-8")
STORED = sorted((ROOT / "tests/records/stored").glob("[0-9]*"))[-1]


def table(page: str, first: str, *, under: str = "") -> list[list[str]]:
    """The rows of the first table after a heading whose header begins with this cell."""
    after = page[page.index(under) :]
    lines = after[after.index(f"\n| {first} |") + 1 :].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]


def names(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


@pytest.mark.parametrize(("name", "written"), [("responses", RESPONSES), ("parameters", PARAMETERS)])
def test_the_columns_of_the_tables_are_those_that_are_written(name: str, written: ColumnTable) -> None:
    listed = [(names(row[0])[0], row[1]) for row in table(PAGE, name)]
    assert listed == [(field.name, str(field.type)) for field in pa.schema(written.schema)]


def test_the_columns_of_the_wide_form_are_those_that_are_written() -> None:
    kinds = {"int64": "int64", "double": "double", "float": "float", "bool": "bool"}
    kinds |= {f"list of {kind}, one for each line": f"fixed_size_list<item: {kind}>[3]" for kind in ("bool", "float")}
    rows = table(PAGE, "column", under="### Wide responses")
    listed = {name: kinds[row[1]] for row in rows for name in names(row[0])}
    assert listed == {field.name: str(field.type) for field in wide_schema(3)}


def test_the_versions_are_those_that_are_written() -> None:
    listed = {row[0]: row[1] for row in table(PAGE, "format")}
    found = {"run directory": VERSIONS["run"], "manifest": VERSIONS["manifest"], "journal": VERSIONS["journal"]}
    found["encoding of states"] = state.ENCODING
    found["baseline"] = json.loads((STORED / "baseline.json").read_text())["version"]
    assert {name: int(listed[name]) for name in found} == found


def test_the_kinds_of_frames_and_the_types_of_arrays_are_those_of_the_code() -> None:
    assert {int(row[0]): row[1] for row in table(PAGE, "kind", under="## Journal")} == {
        FORMAT: "format", ROWS: "rows", COMMIT: "commit", TABLE: "table",
    }  # fmt: skip
    assert all(f"`{name}`" in PAGE for name in state.DTYPES)


def test_heads_have_the_fields_and_the_sizes_that_are_listed() -> None:
    for under, magic, size in (("## Journal", b"LB", 16), ("## States", b"LBST", 20)):
        rows = table(PAGE, "byte", under=under)
        assert names(rows[0][3]) == [magic.decode()]
        assert int(rows[-1][0]) == size == sum(int(row[1]) for row in rows[:-1])
    assert len(frames.to_frame(COMMIT)) == 16
    text = f'{{"stage":"a","settings":"","livebode":"{__version__}","plain":{{}},"arrays":{{}},"parts":{{}}}}'
    assert len(state.encode(state.Stage("a", 1), {})) == 20 + len(text)


def keys(rows: list[list[str]]) -> set[str]:
    return {name for row in rows for name in names(row[0])}


def test_the_keys_of_stored_files_are_listed(tmp_path: Path) -> None:
    run = keys(table(PAGE, "key", under="## run.json")) | keys(table(RUN_PAGE, "key", under="## run.json"))
    for kind in ("piece", "segments"):
        assert set(plain(STORED / kind / "run.json")) <= run, kind
    event = keys(table(PAGE, "key", under="## Lines with a checksum")) | {"crc32"}
    assert {key for line in lines(STORED / "piece/events.jsonl") for key in line} == event
    closed = lines(STORED / "segments/manifest.jsonl")[2]
    segment = keys(table(PAGE, "key", under="### Manifest"))
    assert {key for one in closed["segments"] for key in one} == segment
    small_baseline().save(tmp_path / "baseline.json")
    written = set(plain(tmp_path / "baseline.json"))
    assert written == keys(table(PAGE, "key", under="## Baseline"))
    assert set(plain(STORED / "baseline.json")) == written


def test_the_keys_of_a_commit_and_of_a_state_are_listed() -> None:
    data = (STORED / "segments/open/000002.journal").read_bytes()
    commit = next(frame for frame in frames.frames(data) if frame.kind == COMMIT)
    assert commit.payload is not None
    length = int.from_bytes(commit.payload[:4], "little")
    assert set(json.loads(bytes(commit.payload[4 : 4 + length]))) == keys(table(PAGE, "key", under="A commit is"))
    found = Journal.read(STORED / "segments", 2).commit
    assert found is not None
    tracker = found.states["tracker"]
    described = json.loads(tracker[20 : 20 + int.from_bytes(tracker[8:12], "little")])
    written = json.loads(state.encode(state.Stage("a", 1), {})[20:])
    assert set(described) | {"livebode"} == set(written) == keys(table(PAGE, "key", under="## States"))


def plain(path: Path) -> Mapping[str, object]:
    return dict(json.loads(path.read_text("utf-8")))


def lines(path: Path) -> list[dict[str, list[dict[str, object]]]]:
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]
