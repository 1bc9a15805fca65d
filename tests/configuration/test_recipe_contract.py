"""A recipe has one name, however its configuration is written; all that the results depend on changes the name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import tomli_w

from livebode.configuration import Axis, axes_of, axis_schema, recipe_id
from livebode.core import LivebodeError, RecordingError
from tests.support.errors import refused
from tests.support.schemas import tables, values_of, with_value

SMALLEST: dict[str, Any] = {"source": {"log": "log.parquet"}, "signals": {"output": "y"}}
LIVE: dict[str, Any] = {"source": {"url": "udp://127.0.0.1:5000"}, "signals": {"output": "y"}}
NEEDED: dict[str, Any] = {
    "motion": {"radius_m": 0.019},
    "loop.velocity": {"gain": 1.0, "rate_hz": 4000},
    "loop.position": {"gain": 1.0, "rate_hz": 4000},
    "loop.position_pd": {"position_gain": 1.0, "velocity_gain": 1.0, "rate_hz": 4000},
}
APART = {"serve", "record", "report", "machine", "publish"}
READING = {"time", "clock", "from", "to", "skip_periods", "rate_hz", "kinds", "units"}
FILES = {("monitoring", "baseline"), ("source", "dbc")}
WHOLE = """
[source]
log = "a.parquet"
rate_hz = 4000
from = 2
[signals]
output = "y"
input = "u"
excitation = "w"
[lines]
frequencies = "20:140:20"
window = 400
[tracking]
hop = 20
[fit]
model = "two-mass"
fixed = { Js = 0.0028, JL = 2 }
[loop.velocity]
gain = 1
rate_hz = 4000
"""


def axis_of(data: dict[str, Any], folder: Path = Path()) -> Axis:
    return axes_of(tomli_w.dumps(data).encode(), folder / "axis.toml", {})[""]


def axis_in(text: str) -> Axis:
    return axes_of(text.encode(), Path("axis.toml"), {})[""]


def accepted(data: dict[str, Any]) -> Axis | None:
    try:
        return axis_of(data)
    except LivebodeError:
        return None


def cases() -> list[tuple[tuple[str, ...], str, dict[str, Any]]]:
    """Every key of axis.toml with the schema of its values, by the table that it is in."""
    return [
        (table, name, key)
        for table, section in tables(axis_schema())
        for name, key in section["properties"].items()
        if table[:1] != ("axes",) and name != "axes" and (*table, name) not in FILES
    ]


def test_each_key_changes_the_name_exactly_where_the_results_depend_on_it() -> None:
    changed: set[tuple[str, ...]] = set()
    for table, name, key in cases():
        base = LIVE if table == ("source",) and name not in READING else SMALLEST
        if (section := ".".join(table)) in NEEDED:
            base = with_value(base, table, NEEDED[section])
        before = axis_of(base)
        for value in values_of(key):
            if (axis := accepted(with_value(base, (*table, name), value))) is None:
                continue
            counts = name in READING if table == ("source",) else not APART & {*table[:1], name}
            differs = recipe_id(axis) != recipe_id(before)
            assert differs == (counts and axis != before), (table, name, value)
            changed |= {(*table, name)} if differs else set()
    assert {("tracking", "hop"), ("lines", "window"), ("signals", "input"), ("fit", "hold"), ("source", "time"),
            ("loop", "velocity", "gain"), ("motion", "chunk_s"), ("monitoring", "covariates")} <= changed  # fmt: skip


def test_a_default_that_is_written_out_changes_nothing() -> None:
    without_loop = WHOLE.partition("[loop")[0]  # its default of infinity cannot be written
    for axis in (axis_of(SMALLEST), axis_in(without_loop)):
        full = axis.model_dump(by_alias=True)
        assert recipe_id(Axis.of(full, "full")) == recipe_id(axis)


def test_order_of_keys_kind_of_numbers_and_place_of_the_data_change_nothing() -> None:
    name = recipe_id(axis_in(WHOLE))
    other = WHOLE.replace('output = "y"\ninput = "u"', 'input = "u"\noutput = "y"')
    other = other.replace("Js = 0.0028, JL = 2", "JL = 2.0, Js = 2.8e-3").replace("gain = 1\n", "gain = 1.0\n")
    assert other != WHOLE
    assert recipe_id(axis_in(other)) == name
    assert recipe_id(axis_in(WHOLE.replace("a.parquet", "elsewhere/b.mat"))) == name
    assert recipe_id(axis_in(WHOLE.replace('"a.parquet"', '["a.mat", "b.mat"]'))) == name


@pytest.mark.parametrize(("section", "key"), [("monitoring", "baseline"), ("source", "dbc")])
def test_a_file_counts_by_its_content_and_not_by_its_path(tmp_path: Path, section: str, key: str) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    for folder in (one, two):
        folder.mkdir()
        (folder / "file").write_bytes(b"first")
    data = with_value(SMALLEST, (section, key), "file")
    name = recipe_id(axis_of(data, one))
    assert recipe_id(axis_of(data, two)) == name != recipe_id(axis_of(SMALLEST))
    (two / "file").write_bytes(b"second")
    assert recipe_id(axis_of(data, two)) != name
    (two / "file").unlink()
    with refused(RecordingError, "not-found"):
        recipe_id(axis_of(data, two))


def test_the_name_stays_in_later_versions() -> None:
    """Where it does not, every stored result would be computed again after an update."""
    assert recipe_id(axis_in(WHOLE)) == "bf7ea6afdc9fd869"
