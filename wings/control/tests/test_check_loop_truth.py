"""`livebode validate --loop` on runs, and what margins and the report say about it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from livebode_control.loop_check.run_loop_check import check_loop_of_run
from livebode_reports.report_data import read
from tests.support.command import livebode
from tests.support.loop_runs import AXIS, record


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("checked")
    record(folder / "log.parquet", 1)
    (folder / "axis.toml").write_text(AXIS.format(gain=0.2308, delay=0), encoding="utf-8")
    done = livebode("run", folder / "axis.toml", "--out", folder / "run")
    assert done.code == 0, done.err
    return folder / "run"


def test_margins_and_report_say_whether_the_loop_was_checked(run: Path) -> None:
    (run / "loop-check.json").unlink(missing_ok=True)
    assert "loop not checked" in livebode("margins", run).out
    assert livebode("validate", run, "--loop").out.startswith("loop checked: as described")
    done = livebode("margins", run, "--json")
    assert json.loads(done.out)["loop_check"]["verdict"] == "as described"
    loop = read(run).loop
    assert loop is not None
    assert loop.checked.verdict == "as described"
    other = run.parent / "gain.toml"
    other.write_text(AXIS.format(gain=0.3, delay=0), encoding="utf-8")
    assert "another description" in livebode("margins", run, "--axis", other).out


def test_a_wrong_word_is_named_with_the_right_value(run: Path) -> None:
    other = run.parent / "wrong.toml"
    other.write_text(AXIS.format(gain=0.25, delay=0), encoding="utf-8")
    done = livebode("validate", run, "--loop", "--axis", other, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["verdict"] == "one change"
    best = found["explanations"][0]
    assert best["key"] == "loop.velocity.gain"
    assert abs(best["value"] - 0.2308) < 1e-4
    other.write_text(AXIS.format(gain=0.2308, delay=1), encoding="utf-8")
    assert "the check found: " in livebode("validate", run, "--loop", "--axis", other).out


def test_two_wrong_words_are_not_explained_by_one(run: Path) -> None:
    other = run.parent / "two.toml"
    other.write_text(AXIS.format(gain=0.25, delay=2), encoding="utf-8")
    done = livebode("validate", run, "--loop", "--axis", other)
    assert "no single change of the description explains it" in done.out
    assert "the nearest single change" in done.out


def test_samples_that_the_run_recorded_are_checked_without_the_recording(run: Path, tmp_path: Path) -> None:
    (tmp_path / "log.parquet").write_bytes((run.parent / "log.parquet").read_bytes())
    words = AXIS.format(gain=0.2308, delay=0) + "[record]\nsamples = true\n"
    (tmp_path / "axis.toml").write_text(words, encoding="utf-8")
    done = livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "recorded")
    assert done.code == 0, done.err
    (tmp_path / "log.parquet").unlink()
    found, _ = check_loop_of_run(tmp_path / "recorded")
    assert found.plain() == check_loop_of_run(run)[0].plain()


def test_a_loop_that_cannot_be_checked_is_refused_in_one_sentence(run: Path, tmp_path: Path) -> None:
    bare = tmp_path / "bare.toml"
    bare.write_text(AXIS.split("[loop.velocity]")[0], encoding="utf-8")
    no_input = tmp_path / "indirect.toml"
    indirect = AXIS.format(gain=0.2308, delay=0).replace('input = "u"\n', "")
    no_input.write_text(indirect.replace("hop = 200", 'hop = 200\nestimator = "indirect"'), encoding="utf-8")
    (tmp_path / "log.parquet").write_bytes((run.parent / "log.parquet").read_bytes())
    assert livebode("run", no_input, "--out", tmp_path / "indirect").code == 0
    for arguments, sentence in (
        ((run, "--axis", bare), "the loop is not described"),
        ((run, "--input", "none"), "none"),
        ((run, "--input", "w"), "three channels"),
        ((tmp_path / "indirect",), "does not name the plant input u"),
        ((tmp_path,), "not the directory of a run"),
    ):
        done = livebode("validate", *arguments, "--loop")
        assert done.code == 2, (arguments, done)
        assert sentence in done.err, done.err
    assert livebode("validate", tmp_path / "indirect", "--loop", "--input", "u").code == 0


def test_a_check_needs_what_it_compares_and_refuses_options_of_the_other(run: Path) -> None:
    for options, sentence in (
        ((), "there is nothing to validate; give --on LOG"),
        (("--axis", run.parent / "axis.toml"), "--axis belongs to --loop"),
        (("--loop", "--on", run), "--on and --loop exclude each other"),
        (("--loop", "--samples", 40), "--samples and --loop exclude each other"),
    ):
        refused = livebode("validate", run, *options)
        assert (refused.code, sentence in refused.err) == (2, True), refused


@pytest.mark.parametrize("command", [["tune"], ["validate", "--loop"]])
def test_a_run_without_a_description_of_its_loop_says_so_and_the_named_lines_work(
    run: Path, tmp_path: Path, command: list[str]
) -> None:
    """Before, tune advised the check, and the check a channel or a run with other signals."""
    words, _, _ = (run.parent / "axis.toml").read_text("utf-8").partition("[loop")
    (tmp_path / "log.parquet").write_bytes((run.parent / "log.parquet").read_bytes())
    (tmp_path / "axis.toml").write_text(words, encoding="utf-8")
    assert livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run").code == 0
    refused = livebode(*command, tmp_path / "run")
    assert "the loop is not described" in refused.err
    line = refused.err[refused.err.index("loop.velocity = {") : refused.err.index("}") + 1]
    (tmp_path / "loop.toml").write_text(line, encoding="utf-8")
    done = livebode(*command, tmp_path / "run", "--axis", tmp_path / "loop.toml")
    assert "the loop is not described" not in done.err
    assert "livebode validate --loop" in done.err if command == ["tune"] else done.code == 0
