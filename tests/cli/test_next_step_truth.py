"""The last line of a command is the command that a person would want next, and it works when it is copied."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from livebode.interface import write_examples
from tests.support.command import livebode, signals, write_csv


def test_from_a_recording_to_the_report_by_copying_the_last_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "my axes"
    folder.mkdir()
    monkeypatch.chdir(folder)
    write_examples(["standstill"], folder)
    (folder / "standstill.csv").rename(folder / "Achse Z.csv")
    words, commands = ["livebode", "inspect", "Achse Z.csv"], []
    while words:
        command = [*words, *(["--yes"] if "--out" in words and words[1] == "inspect" else [])]
        if command[1] == "run":
            command += ["--out", "runs/Achse Z"]
        result = livebode(*command[1:])
        assert result.code == 0, result.err
        commands.append(words[1])
        last = result.out.splitlines()[-1]
        words = shlex.split(last.removeprefix("Next: ")) if last.startswith("Next: ") else []
    assert commands == ["inspect", "inspect", "run", "fit", "report"]


def test_json_and_a_failure_have_no_next_line(tmp_path: Path) -> None:
    write_csv(tmp_path / "log.csv", signals())
    assert "Next:" not in livebode("run", tmp_path / "log.csv", "--out", tmp_path / "run", "--json").out
    assert "Next:" not in livebode("inspect", tmp_path / "none.csv").out


def test_a_run_with_a_fit_leads_to_its_report_and_a_run_of_modes_to_the_page(tmp_path: Path) -> None:
    write_csv(tmp_path / "log.csv", signals())
    fitted = livebode("inspect", tmp_path / "log.csv", "--yes", "--fit", "two-mass", "--out", tmp_path / "axis.toml")
    assert fitted.out.splitlines()[-1] == f"Next: {shlex.join(['livebode', 'run', str(tmp_path / 'axis.toml')])}"
    several = [tmp_path / "log.csv", "--excitation", "w", "--input", "u", "--output", "y", "--output=-y"]
    for words, following in (
        ([tmp_path / "axis.toml"], "report"),
        ([tmp_path / "log.csv", "--output-only", "--output", "y"], "view"),
        (["--accept-roles", *several], "view"),
    ):
        out = tmp_path / f"{following}{len(words)}"
        last = livebode("run", *words, "--out", out).out.splitlines()[-1]
        assert last == f"Next: {shlex.join(['livebode', following, str(out)])}"


def test_the_next_command_has_the_rate_that_the_recording_lacks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    columns = {name: values for name, values in signals().items() if name != "t"}
    rows = [",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in zip(*columns.values()))]
    Path("plain.csv").write_text("\n".join(rows))
    first = livebode("inspect", "plain.csv", "--rate", "1000")
    command = shlex.split(first.out.splitlines()[-1].removeprefix("Next: livebode "))
    assert livebode(*command, "--yes").code == 0


def test_where_a_run_is_needed_a_file_is_answered_with_the_command_that_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_examples(["standstill"], tmp_path)
    refused = livebode("fit", "standstill.toml")
    assert refused.err.count("livebode run standstill.toml") == 1
    ran = livebode("run", "standstill.toml")
    assert "newest fit" not in ran.out  # of an average there is one fit
    assert "rejected: no response" not in ran.out
    assert livebode("fit", "runs/standstill").code == 0
    assert "livebode view runs/standstill" in livebode("run", "runs/standstill").err


def test_a_hop_beyond_the_recording_is_a_sentence_and_no_run_without_responses(tmp_path: Path) -> None:
    write_csv(tmp_path / "log.csv", signals())
    result = livebode("run", tmp_path / "log.csv", "--hop", "10000000", "--out", tmp_path / "run")
    assert (result.code, (tmp_path / "run").exists()) == (2, False)
    assert "less than the hop of 10000000; choose a shorter hop" in result.err
