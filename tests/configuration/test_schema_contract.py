"""The schema of axis.toml and the models accept and refuse the same values, apart from what needs more than one key."""

from __future__ import annotations

import ast
import copy
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from livebode.configuration import axes_of, axis_schema
from livebode.core import ConfigError, LivebodeError
from livebode.plugins import named
from livebode.sources.live import SourceSettings, make_source
from tests.support.schemas import tables, validator, values_of, with_value

ROOT = Path(__file__).parents[2]
SCHEMA = axis_schema()
VALID = validator(SCHEMA)
SMALLEST: dict[str, Any] = {"source": {"log": "log.parquet"}, "signals": {"output": "y"}}
REQUIRED: dict[str, Any] = {
    "motion": {"radius_m": 0.019},
    "loop.velocity": {"gain": 1.0, "rate_hz": 4000},
    "loop.position": {"gain": 1.0, "rate_hz": 4000},
    "loop.position_pd": {"position_gain": 1.0, "velocity_gain": 1.0, "rate_hz": 4000},
}
MATRIX: dict[str, Any] = SMALLEST | {
    "signals": {"output": ["y", "z"], "input": "u", "excitation": "w"},
    "lines": {"frequencies": "20", "window": 400},
}
TABLES = dict(tables(SCHEMA))


def accepted(data: dict[str, Any]) -> bool:
    try:
        axes_of(tomli_w.dumps(data).encode(), Path("axis.toml"), {})
    except LivebodeError:
        return False
    return True


def base_of(table: tuple[str, ...]) -> dict[str, Any]:
    name = ".".join(table)
    if name == "experiments":
        return MATRIX
    return with_value(SMALLEST, table, copy.deepcopy(REQUIRED[name])) if name in REQUIRED else SMALLEST


@pytest.mark.parametrize("table", TABLES, ids=".".join)
def test_every_key_has_a_description(table: tuple[str, ...]) -> None:
    for name, key in TABLES[table]["properties"].items():
        assert re.fullmatch(r"\S.*\.", key["description"]), name


@pytest.mark.parametrize("table", TABLES, ids=".".join)
def test_a_value_is_valid_where_livebode_accepts_it(table: tuple[str, ...]) -> None:
    """Every type, every choice, and the values at and just outside the limits."""
    for name, key in TABLES[table]["properties"].items():
        for value in values_of(key) if name != "axes" else ():
            base = MATRIX if (*table, name) == ("monitoring", "gantry") else base_of(table)
            data = with_value(base, (*table, name), value)
            if name in ("url", "replay"):
                del data["source"]["log"]
            address = name == "url" and isinstance(value, str)  # its parts are checked by livebode only
            assert VALID.is_valid(data) == accepted(data) or address, (table, name, value)
    unknown = with_value(base_of(table), (*table, "unknown"), 1)
    assert not VALID.is_valid(unknown)
    assert not accepted(unknown)


@pytest.mark.parametrize("kind", named("sources"))
def test_a_source_has_the_keys_of_its_kind(kind: str) -> None:
    url = named("sources")[kind].device or f"{kind}://192.168.0.5:5000"
    for name, key in TABLES[("source",)]["properties"].items():
        if name not in ("log", "url", "follow", "replay"):
            candidates = (key.get("default"), "x", 2, 5000, ["x"], {"x": "x"}, *key.get("enum", []))
            value = next(value for value in candidates if fits(key, value))
            data = SMALLEST | {"source": {"url": url, name: value}}
            assert VALID.is_valid(data) == accepted(data), (name, value)


def test_a_recording_that_grows_has_the_keys_of_a_recording() -> None:
    source = {"log": "log.csv", "follow": True, "nodes": {"w": "ns=2;s=w"}}
    with pytest.raises(ConfigError, match="nodes does not apply"):
        make_source(SourceSettings(log=Path("log.csv"), follow=True, nodes={"w": "ns=2;s=w"}))
    assert not VALID.is_valid(SMALLEST | {"source": source})


def fits(key: dict[str, Any], value: Any) -> bool:
    return value is not None and validator(key).is_valid(value)


@pytest.mark.parametrize(
    "data",
    [
        {},
        {"source": {}},
        {"source": {"log": "a", "url": "udp://h:1"}},
        {"source": {"url": "udp://h:1", "follow": True}},
        {"source": {"log": "a", "replay": "runs/b"}},
        {"source": {"replay": "runs/b", "rate_hz": 4000.0}},
        {"signals": {}},
        {"motion": {}},
        {"loop": {"velocity": {"gain": 1.0}}},
        {"axes": {}},
        {"axes": {"a b": SMALLEST}},
        {"axes": {"x-2": SMALLEST}},
        {"axes": {"x": {"lines": {"windows": 400}}}},
    ],
)
def test_what_is_missing_or_contradicts_another_key_is_refused_by_both(data: dict[str, Any]) -> None:
    data = SMALLEST | data if data else {}
    assert not accepted(data)
    assert not VALID.is_valid(data)


def test_a_key_of_several_axes_may_be_common_or_of_its_axis() -> None:
    data = {"signals": {}, "source": {"rate_hz": 4000.0}, "axes": {"x": SMALLEST}}
    assert accepted(data)
    assert VALID.is_valid(data)


def test_every_configuration_in_the_repository_that_livebode_accepts_is_valid() -> None:
    """Files, blocks on pages, and texts in the tests."""
    texts = [path.read_text("utf-8") for path in ROOT.glob("examples/**/*.toml")]
    for page in (ROOT / "README.md", *ROOT.glob("docs/**/*.md")):
        texts += re.findall(r"^```toml\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S)
    for path in ROOT.glob("tests/**/*.py"):
        if "[source]" in (text := path.read_text("utf-8")):
            constants = [node.value for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant)]
            texts += [value for value in constants if isinstance(value, str) and "[source]" in value]
    found = 0
    for text in texts:
        try:
            data = tomllib.loads(text)
        except ValueError:
            continue
        if accepted(data):
            VALID.validate(data)
            found += 1
    assert found >= 20
