"""The bundle holds what a report needs, no secret, and appears whole or not at all."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from livebode.configuration import MAY_BE_SECRET, Axis
from livebode.core import OutputError, TypedTable
from livebode.doctor import Check, Subject, bundle, write_bundle
from livebode.doctor.bundle import REMOVED, Secrets
from livebode_design import Experiment
from tests.support.command import livebode, signals
from tests.support.runs import small_run
from tests.support.small_axis import ONE_LINE

SECRET = "hunter2-and-more"


def models(annotation: Any) -> Iterator[type[Any]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel | TypedTable):
        yield annotation
    for inner in get_args(annotation):
        yield from models(inner)


def leaves(model: type[Any], place: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Every key of a configuration, by its place."""
    for name, field in model.model_fields.items():
        inner = next(models(field.annotation), None)
        if inner is None:
            yield (*place, name)
        else:
            yield from leaves(inner, (*place, name))


KEYS = [*leaves(Axis)]


def holding(place: tuple[str, ...], value: object) -> dict[str, Any]:
    return {place[0]: value if len(place) == 1 else holding(place[1:], value)}


def at(table: dict[str, Any], place: tuple[str, ...]) -> Any:
    return table[place[0]] if len(place) == 1 else at(table[place[0]], place[1:])


def contents(path: Path) -> dict[str, str]:
    with zipfile.ZipFile(path) as found:
        assert found.testzip() is None
        return {name: found.read(name).decode() for name in found.namelist()}


def test_every_key_of_the_models_that_names_a_secret_is_known_as_one() -> None:
    naming = {place[-1] for place in (*KEYS, *leaves(Experiment)) if any(
        word in place[-1] for word in ("password", "token", "username", "secret", "url", "credential", "login")
    )}  # fmt: skip
    assert naming == MAY_BE_SECRET


@pytest.mark.parametrize("place", KEYS, ids=".".join)
def test_only_values_of_secret_keys_are_removed(tmp_path: Path, place: tuple[str, ...]) -> None:
    secrets = Secrets(tmp_path)
    for table in (holding(place, SECRET), {"axes": {"a": holding(place, SECRET)}}):
        kept = secrets.configuration(table)
        kept = kept["axes"]["a"] if "axes" in table else kept
        assert at(kept, place) == (REMOVED if place[-1] in MAY_BE_SECRET else SECRET)


@pytest.mark.parametrize(
    "source",
    [
        f'url = "mqtt://me:{SECRET}@127.0.0.1/t"',
        f'url = "mqtt://{SECRET}@127.0.0.1/t"',
        f'url = "mqtt://me:{SECRET}%40127.0.0.1/t"',
        f'url = "mqtt://me:{SECRET}"',
        f'url = "udp://127.0.0.1:1?password={SECRET}"',
        f'url = "http://127.0.0.1:1/{SECRET}@"',
        f'url = ["mqtt://me:{SECRET}@127.0.0.1:1/t"]',
        f'url = {{ a = "mqtt://me:{SECRET}@127.0.0.1:1/t" }}',
        f'log = "mqtt://me:{SECRET}@127.0.0.1:1/t"',
        f'log = "https://127.0.0.1:1/a.csv?signature={SECRET}"',
        f'url = "mqtt://127.0.0.1:1/t"\npassword = "{SECRET}"',
        f'url = "mqtt://127.0.0.1:1/t"\npassword_env = "{SECRET}"',
        f'url = "mqtt://127.0.0.1:1/t"\npassword_env = ["{SECRET}"]',
        f'url = "mqtt://127.0.0.1:1/t"\npassword_file = "{SECRET}"',
        f'url = "mqtt://127.0.0.1:1/t"\nusername = "{SECRET}"',
        f'url = "mqtt://127.0.0.1:1/t"\nkey = "{SECRET}"',
        f'url = "mqtt://127.0.0.1:1/t" # {SECRET}',
        f'url = "mqtt://127.0.0.1:1/t"\n[source.broker]\npasswd = "{SECRET}"',
    ],
)
def test_no_secret_of_a_configuration_is_in_the_bundle(tmp_path: Path, source: str) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(f"[source]\n{source}\n{ONE_LINE}")
    found = tmp_path / "report.zip"
    done = livebode("--log-file", tmp_path / "own.log", "doctor", path, "--bundle", found)
    assert found.exists(), done.err
    for name, text in contents(found).items():
        assert SECRET not in text, name


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    word=st.text(st.characters(categories=("L", "N", "P", "S")), min_size=4, max_size=40).filter(lambda w: w.strip()),
    key=st.sampled_from(sorted(MAY_BE_SECRET - {"url", "username"})),
)
def test_a_secret_of_the_configuration_is_removed_from_every_text(tmp_path: Path, word: str, key: str) -> None:
    secrets = Secrets(tmp_path)
    section = {"password": "source", "url": "publish", "secret": "publish"}.get(key.partition("_")[0], "serve")
    secrets.configuration({section: [{key: word}] if section == "publish" else {key: word}})
    if word in REMOVED or (tmp_path / word).is_file():
        return
    assert word not in secrets.text(f"a message with {word} in it").replace(REMOVED, "")
    assert secrets.plain({"facts": [word]}) == {"facts": [secrets.text(word)]}


def test_a_secret_of_a_password_file_is_removed_from_events_and_log(tmp_path: Path) -> None:
    (tmp_path / "p").write_text(SECRET + "\n")
    secrets = Secrets(tmp_path)
    table = {"source": {"url": "mqtt://127.0.0.1:1/t", "password_file": "p", "client_id": "c"}}
    assert secrets.configuration(table) == table
    assert secrets.text(f"the broker refused {SECRET}") == f"the broker refused {REMOVED}"


def test_a_bundle_of_a_run_holds_its_summary_its_newest_events_versions_checks_and_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bundle, "EVENTS_MAX", 2)
    columns = signals(4000)
    for sample in (500, 1500, 2500, 3500):
        columns["y"][sample] = float("nan")
    small_run(tmp_path, columns)
    done = livebode(
        "--log-file", tmp_path / "own.log", "doctor", tmp_path / "run", "--bundle", tmp_path / "b.zip", "--json"
    )
    found = contents(tmp_path / "b.zip")
    assert list(found) == json.loads(done.out)["files"]
    assert json.loads(found["run.json"])["counts"] == json.loads((tmp_path / "run/run.json").read_text())["counts"]
    own = [json.loads(line) for line in (tmp_path / "run/events.jsonl").read_text().splitlines()]
    assert [json.loads(line)["sample"] for line in found["events.jsonl"].splitlines()] == [
        e["sample"] for e in own[-2:]
    ]
    assert json.loads(found["versions.json"])["packages"]["livebode"]
    assert {check["name"] for check in json.loads(found["doctor.json"])["checks"]} >= {"disk", "run", "clock"}
    assert "livebode doctor begins" in found["logs/own.log"]


def test_a_bundle_is_replaced_only_with_force_and_is_left_whole_where_it_cannot_be_written(tmp_path: Path) -> None:
    path = tmp_path / "b.zip"
    assert livebode("doctor", "--bundle", path).err == ""
    before = path.read_bytes()
    done = livebode("doctor", "--bundle", path)
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert path.read_bytes() == before
    livebode("doctor", "--bundle", path, "--force")
    contents(path)
    with pytest.raises(OutputError):
        write_bundle(path / "b.zip", Subject(), [])
    assert [found.name for found in tmp_path.iterdir()] == ["b.zip"]


def test_a_bundle_is_of_bounded_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bundle, "PART_BYTES_MAX", 10_000)
    checks = [Check("many", "ok", "x" * 1000)] * 30
    write_bundle(tmp_path / "b.zip", Subject(), checks)
    found = contents(tmp_path / "b.zip")
    assert max(map(len, found.values())) <= bundle.PART_BYTES_MAX
    assert found["doctor.json"].startswith("left out: longer than")
