"""A command that fails: one line with the options that it is about, or with --json one object."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer

from livebode.cli.app import app
from livebode.cli.failures import failure_of, name_options
from livebode.core import ConfigError, LivebodeError, OutputError, UsageError
from tests.support.command import livebode
from tests.support.reports import measured, write_run

COMMANDS = {
    " ".join([name, *inner]): one
    for name, command in typer.main.get_command(app).commands.items()
    for inner, one in [([word], one) for word, one in getattr(command, "commands", {}).items()] or [([], command)]
    if "view" not in (name, *inner)  # a page has no result
}
LIVEBODE = str(Path(sys.executable).with_name("livebode"))


def error_of(result: Any, code: int = 2) -> dict[str, Any]:
    assert (result.code, result.out) == (code, ""), result
    found = json.loads(result.err)
    assert list(found) == ["error"]
    assert list(found["error"]) == ["code", "place", "message", "remedy", "facts"]
    return found["error"]


def named(error: LivebodeError, command: str) -> list[str]:
    name_options(error, COMMANDS[command].params)
    return error.facts.get("options", [])


def test_a_process_that_fails_prints_one_object_and_ends_with_2(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("t,w,y\n0,1,2\n0.001,2,3\n")
    done = subprocess.run([LIVEBODE, "run", "log.csv", "--json"], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    error = json.loads(done.stderr)["error"]
    assert error["code"] == "usage.missing"
    assert error["facts"] == {"options": ["--excitation", "--input", "--output"]}
    assert list(tmp_path.iterdir()) == [log]


def test_an_internal_error_is_an_object_with_its_traceback_and_ends_with_1(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebode.preparation.inspect", lambda *_, **__: 1 / 0)
    error = error_of(livebode("inspect", "log.parquet", "--json"), code=1)
    assert (error["code"], error["message"]) == ("internal", "ZeroDivisionError: division by zero")
    assert error["facts"]["traceback"].startswith("Traceback")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_json_and_reports_a_wrong_option_so(command: str) -> None:
    error = error_of(livebode(*command.split(), "--json", "--nonsense"))
    assert error["code"] == "usage.options"
    assert error["message"].startswith("No such option: --nonsense")
    assert "--json" in {option for parameter in COMMANDS[command].params for option in parameter.opts}


def test_a_missing_argument_is_reported_as_an_object_too() -> None:
    assert error_of(livebode("fit", "--json"))["code"] == "usage.options"


@pytest.mark.parametrize("words", ["--log-level foo run log.csv", "doctor --receivers foo", "archive run --retry foo"])
def test_a_wrong_choice_is_reported_without_the_name_of_the_error(words: str) -> None:
    refused = livebode(*words.split())
    assert refused.code == 2
    assert "'foo' is not one of" in refused.err
    assert "Value error" not in refused.err + livebode(*words.split(), "--json").err


def test_without_json_an_error_is_one_line_with_its_option(tmp_path: Path) -> None:
    result = livebode("run", tmp_path / "log.csv", "--output", "y", "--window", "long")
    assert (result.code, result.err.count("\n")) == (2, 1)
    assert result.err.endswith("write for example 4000, or auto (option --window)\n")


def test_an_argument_or_key_is_mapped_to_the_option_of_this_command_without_its_unit() -> None:
    assert named(UsageError("missing", "no rate", argument="rate_hz"), "run") == ["--rate"]
    assert named(UsageError("missing", "no rate", argument="rate"), "inspect") == ["--rate"]
    assert named(UsageError("out-of-range", "large", argument="amplitude_n_m"), "design") == ["--amplitude"]
    assert named(ConfigError("key-missing", "none", key="tracking.hop"), "run") == ["--hop"]
    assert named(UsageError("missing", "no channel", argument="input"), "inspect") == ["--input"]
    assert named(UsageError("out-of-range", "small", argument="hop"), "design") == []
    assert named(UsageError("out-of-range", "small", argument="window_max"), "run") == []
    assert named(OutputError("exists", "there already"), "export") == ["--out", "--force"]


def test_options_that_the_sentence_names_are_not_named_again() -> None:
    error = OutputError("exists", "a.csv exists already", "choose another --out")
    name_options(error, COMMANDS["export"].params)
    assert failure_of(error).text == "livebode: a.csv exists already; choose another --out (option --force)"


def test_facts_that_json_cannot_write_are_texts_or_numbers() -> None:
    import numpy as np

    facts = {"path": Path("a"), "count": np.int64(3), "sizes": (np.float64(0.5), np.arange(2))}
    error = failure_of(UsageError("out-of-range", "odd", **facts)).error
    assert json.loads(json.dumps(error["facts"])) == {"path": "a", "count": 3, "sizes": [0.5, [0, 1]]}


def test_export_with_json_prints_one_object(tmp_path: Path) -> None:
    run = write_run(tmp_path / "run", measured(5, 1))
    exported = livebode("export", run, "--to", "csv", "--out", tmp_path / "a.csv", "--json")
    assert json.loads(exported.out) == {"file": str(tmp_path / "a.csv"), "rows": 5, "left_out": 0}
    error = error_of(livebode("export", run, "--to", "csv", "--at", 1, "--mean", "--json"))
    assert (error["code"], error["facts"]["options"]) == ("usage.conflict", ["--at", "--mean"])
