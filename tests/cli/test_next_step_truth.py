"""The last line of a command is the command that a person would want next, and it works when it is copied."""

from __future__ import annotations

import shlex
import urllib.request
from pathlib import Path

import pytest

from livebode.interface import write_examples
from tests.support.command import livebode, signals, write_csv
from tests.support.served import served


def following(command: str) -> list[str]:
    """Run a command, and return the words of the command that its last line proposes."""
    result = livebode(*shlex.split(command))
    assert result.code == 0, (command, result.err)
    words = shlex.split(result.out.splitlines()[-1].removeprefix("Next: "))
    assert words[0] == "livebode", (command, result.out)
    return words[1:]


def test_from_a_recording_to_the_report_by_copying_the_last_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "my axes"
    folder.mkdir()
    monkeypatch.chdir(folder)
    write_examples(["standstill"], folder)
    (folder / "standstill.csv").rename(folder / "Achse Z.csv")
    words, commands = ["livebode", "inspect", "Achse Z.csv"], []
    while "view" not in words:
        command = [*words, *(["--yes"] if "--out" in words and words[1] == "inspect" else [])]
        if command[1] == "run":
            command += ["--out", "runs/Achse Z"]
        result = livebode(*command[1:])
        assert result.code == 0, result.err
        commands.append(words[1])
        words = shlex.split(result.out.splitlines()[-1].removeprefix("Next: "))
    assert commands == ["inspect", "inspect", "run", "report"]
    assert words == ["livebode", "view", "runs/Achse Z"]


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


@pytest.mark.parametrize(
    ("examples", "before", "command", "proposed"),
    [
        ("standstill", "", "example", "example standstill"),
        ("standstill", "run standstill.toml", "export runs/standstill --to csv", "report runs/standstill"),
        (
            "standstill",
            "run standstill.toml",
            "validate runs/standstill --on standstill-2.csv",
            "report runs/standstill",
        ),
        ("tune", "run tune.toml", "validate runs/tune --loop", "report runs/tune"),
        ("tune", "run tune.toml", "margins runs/tune", "report runs/tune"),
        ("tune", "run tune.toml; validate runs/tune --loop", "tune runs/tune", "report runs/tune"),
        ("strokes", "", "friction strokes.toml", "friction strokes.toml --places 8"),
        ("strokes", "", "orders strokes.toml", "orders strokes.toml --table feedforward.csv"),
        ("design", "", "design experiment.toml", "measure experiment.toml --simulated"),
    ],
)
def test_the_proposed_command_works(
    examples: str, before: str, command: str, proposed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_examples([examples], tmp_path)
    for earlier in filter(None, before.split("; ")):
        assert livebode(*earlier.split()).code == 0
    words = following(command)
    assert words == proposed.split()
    result = livebode(*words)
    assert result.code == 0, result.err


def test_a_learned_baseline_is_tried_on_the_newest_run_of_a_configuration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_examples(["fault"], tmp_path)
    for name in ("monday", "tuesday"):
        assert livebode("run", f"{name}.toml").code == 0
    words = following("learn runs/monday runs/tuesday --out healthy.json")
    assert words == ["run", "tuesday.toml", "--baseline", "healthy.json"]
    following(shlex.join(words))
    (tmp_path / "tuesday.toml").unlink()
    words = following("learn runs/monday runs/tuesday --out other.json")
    assert words == ["learn", "--history", "other.json"]
    assert livebode(*words).code == 0


def test_two_compared_runs_are_shown_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("before", "after"):
        write_csv(tmp_path / f"{name}.csv", signals())
        following(f"run {name}.csv")
    words = following("compare runs/before runs/after")
    assert words == ["view", "runs/before", "runs/after"]
    with served(tmp_path, *words) as (_, address):
        page = urllib.request.urlopen(address).read().decode()
    assert "livebode" in page


def test_blocks_for_a_plc_are_followed_by_a_check_of_its_axis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_examples(["standstill"], tmp_path)
    with (tmp_path / "standstill.toml").open("a") as file:
        file.write("\n[serve]\nport = 0  # the usual one may be taken on this computer\n")
    words = following("plc standstill.toml --limit 1 --amplitude 0.1 --rate 4000 --out plc")
    assert words == ["doctor", "standstill.toml"]
    assert following(shlex.join(words)) == ["run", "standstill.toml"]


def test_an_archive_leads_from_its_runs_to_the_trends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_examples(["archive"], tmp_path)
    words, commands = ["archive", "run", "archive.toml"], []
    while words:
        commands.append(words)
        result = livebode(*words)
        assert result.code == 0, result.err
        last = result.out.splitlines()[-1]
        words = shlex.split(last)[2:] if last.startswith("Next: ") else []
    assert [command[1] for command in commands][:3] == ["run", "list", "trend"]
