"""Mistakes that people make in TOML are answered with the line that they meant, which works when it is written."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from livebode.configuration import Axis, parse_table
from livebode.core import ConfigError
from tests.support.command import livebode

HEAD = "# my axis\n[source]\nrate_hz = 4000\n"
MISTAKES = [
    (r'log = "C:\data\log.csv"', r"log = 'C:\data\log.csv'"),
    (r'log = "C:\Users\me\log.csv"', r"log = 'C:\Users\me\log.csv'"),
    ("output = velocity", 'output = "velocity"'),
    ("output = Actual speed  # of the motor", 'output = "Actual speed" # of the motor'),
    ("output: velocity", 'output = "velocity"'),
    ('output: "velocity"', 'output = "velocity"'),
    ("window: 400", "window = 400"),
    ("forgetting = 0,8", "forgetting = 0.8"),
    ("forgetting = 0,8 # of a period", "forgetting = 0.8 # of a period"),
    ("average = True", "average = true"),
    ("frequencies = 20:140:20", 'frequencies = "20:140:20"'),
    ("output = “velocity”", 'output = "velocity"'),
    ("output = „velocity“", 'output = "velocity"'),
    ('output = "velocity', 'output = "velocity"'),
    ("; the motor", "# the motor"),
    ("// the motor", "# the motor"),
    ("[signals", "[signals]"),
    ("[signals  # of the drive", "[signals]  # of the drive"),
    ('output = "velocity  # of the motor', 'output = "velocity"  # of the motor'),
    ("output = 'velocity  # of the motor", "output = 'velocity'  # of the motor"),
    ("window = 4,000  # samples", "window = 4000  # samples"),
    ("average = yes", "average = true"),
    ("average = Off  # all", "average = false  # all"),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "meant"), MISTAKES, ids=[wrong for wrong, _ in MISTAKES])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_line_that_was_meant_is_given_and_works(wrong: str, meant: str, end: str) -> None:
    text = f"{HEAD}{wrong}\nclock = 'utc'\n".replace("\n", end)
    with pytest.raises(ConfigError) as caught:
        parse_table(text.encode(), "axis.toml")
    error = caught.value
    assert (error.code, error.facts["line"]) == ("config.not-toml", 4)
    assert f"in line 4: {wrong}" in error.message
    assert error.remedy.startswith(f"write {meant}")
    parse_table(text.replace(wrong, meant).encode(), "axis.toml")


def test_a_comma_that_may_be_a_decimal_one_has_both_readings() -> None:
    with pytest.raises(ConfigError) as caught:
        parse_table(b"[lines]\nwindow = 1,125\n", "axis.toml")
    assert caught.value.remedy == "write window = 1125, or window = 1.125 if the comma is a decimal one"


@pytest.mark.parametrize(
    "text", ["[lines]\nwindow = 400\nwindow = 200\n", "[lines]\nwindow = 400\n[fit]\n[lines]\n", "a = 1\na.b = 2\n"]
)
def test_what_is_in_the_file_twice_is_named_with_its_line(text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_table(text.encode(), "axis.toml")
    last = text.splitlines()[-1]
    assert f"in line {text.count(chr(10))}: {last}" in caught.value.message
    assert caught.value.remedy.startswith("it is in the file twice; remove one")
    parse_table(text.removesuffix(f"{last}\n").encode(), "axis.toml")


@pytest.mark.parametrize(
    ("section", "wrong", "meant"),
    [
        ("lines", 'window = "400"', "400"),
        ("lines", "window = 400.0", "400"),
        ("lines", "frequencies = [20, 40]", '"20,40"'),
        ("tracking", 'average = "yes"', "true"),
        ("tracking", 'forgetting = "0,8"', "0.8"),
    ],
)
def test_a_value_of_the_wrong_type_is_given_as_it_is_written(section: str, wrong: str, meant: str) -> None:
    tables = {"source": {"log": "y.csv"}, "signals": {"output": "y", "input": "u"}, "lines": {}, "tracking": {}}
    with pytest.raises(ConfigError) as caught:
        Axis.of(tables | tomllib.loads(f"[{section}]\n{wrong}\n"), "axis.toml")
    assert caught.value.remedy == f"write {meant}"
    Axis.of(tables | tomllib.loads(f"[{section}]\n{wrong.partition('=')[0]} = {meant}\n"), "axis.toml")


def test_a_key_below_the_wrong_header_is_given_its_own() -> None:
    with pytest.raises(ConfigError) as caught:
        Axis.of({"source": {"log": "y.csv", "excitation": "w"}, "signals": {"output": "y", "input": "u"}}, "axis.toml")
    assert caught.value.remedy == "it belongs to [signals]: write it below that header"


@pytest.mark.parametrize(
    ("written", "meant"),
    [(r"C:\temp\bode.csv", r"C:\temp\bode.csv"), (r"\fileserver\bode.csv", r"\fileserver\bode.csv")],
)
def test_a_path_whose_backslashes_are_read_as_special_letters_is_given_as_it_was_written(
    written: str, meant: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_table(f'[source]\nlog = "{written}"\n'.encode(), "axis.toml")
    assert caught.value.remedy == f"write '{meant}' in single quotes, or {meant.replace(chr(92), '/')}"
    assert parse_table(f"[source]\nlog = '{meant}'\n".encode(), "axis.toml")["source"]["log"] == meant


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_file_of_an_editor_of_windows_is_read(encoding: str) -> None:
    text = "# Vorschub in µm\r\n[signals]\r\n\toutput = 'Größe'\t# Ist\r\n"
    assert parse_table(text.encode(encoding), "axis.toml") == {"signals": {"output": "Größe"}}


def test_a_letter_of_another_encoding_is_named_with_its_line() -> None:
    with pytest.raises(ConfigError) as caught:
        parse_table("[signals]\noutput = 'Istgröße'\n".encode("cp1252"), "axis.toml")
    assert "is not UTF-8 in line 2: output = 'Istgröße'" in caught.value.message
    assert "UTF-8" in caught.value.remedy
    with pytest.raises(ConfigError, match="is not text; give a configuration in TOML"):
        parse_table(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\xff", "axis.toml")


def test_in_the_terminal_it_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text('[source]\nlog = "C:\\data\\log.csv"\n')
    result = livebode("run", tmp_path / "axis.toml")
    assert (result.code, result.err.count("\n")) == (2, 1)
    assert r"write log = 'C:\data\log.csv' or log = 'C:/data/log.csv'" in result.err
