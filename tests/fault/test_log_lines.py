"""The log: quiet by default, one safe line for each record, and no disk or reader of it ends a run."""

from __future__ import annotations

import logging
import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.cli.log_output import LineFormatter, log_output
from tests.command import livebode, signals, write_parquet

LINE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z (DEBUG|INFO|WARNING|ERROR) livebode\.[a-z0-9_.]+: .+")
ROLES = ("--output", "y", "--input", "u", "--excitation", "w", "--json")


def test_a_program_that_asks_for_no_log_sees_none() -> None:
    code = "import livebode, logging; logging.getLogger('livebode.session.live').error('not shown')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == ""


@given(st.text(), st.text(min_size=1), st.floats(0, 4e9))
def test_a_record_is_one_printable_line_whatever_it_holds(message: str, fact: str, at_s: float) -> None:
    try:
        raise ValueError(fact)
    except ValueError:
        record = logging.LogRecord("livebode.x", logging.INFO, "", 0, "%s %s", (message, fact), sys.exc_info())
    record.created = at_s
    line = LineFormatter().format(record)
    assert len(line.splitlines()) == 1
    assert not re.search("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202e]", line)
    assert LINE.match(line)


@pytest.mark.parametrize("before", [True, False])
def test_the_log_goes_to_a_file_with_options_before_or_behind_the_command(tmp_path: Path, before: bool) -> None:
    log = write_parquet(tmp_path / "log.parquet", signals(1000))
    own = tmp_path / "own.log"
    options, command = ("--log-level", "debug", "--log-file", own), ("run", log, *ROLES, "--out", tmp_path / "run")
    done = livebode(*options, *command) if before else livebode(*command, *options)
    assert (done.code, done.err) == (0, "")
    lines = own.read_text().splitlines()
    assert all(LINE.fullmatch(line) for line in lines)
    assert lines[0].endswith("livebode run begins")
    assert lines[-1].endswith("livebode run ends")
    assert logging.getLogger("livebode").level == logging.NOTSET


def test_a_file_alone_has_level_info_and_an_error_with_its_code(tmp_path: Path) -> None:
    own = tmp_path / "own.log"
    done = livebode("run", tmp_path / "missing.parquet", *ROLES, "--log-file", own)
    assert done.code == 2
    (error,) = [line for line in own.read_text().splitlines() if " ERROR " in line]
    assert done.err.removeprefix("livebode: ").strip() in error


def test_the_log_goes_to_standard_error_without_a_file(tmp_path: Path) -> None:
    done = livebode("--log-level", "info", "inspect", write_parquet(tmp_path / "log.parquet", signals(1000)))
    assert done.code == 0
    assert done.err
    assert all(LINE.fullmatch(line) for line in done.err.splitlines())


def test_a_level_that_does_not_exist_or_a_file_that_cannot_be_opened_is_refused(tmp_path: Path) -> None:
    assert livebode("--log-level", "loud", "doctor").code == 2
    done = livebode("--log-file", tmp_path / "none" / "own.log", "doctor")
    assert done.code == 2
    assert done.err.count("\n") == 1


def test_a_disk_that_takes_no_log_line_costs_the_line_and_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "own.log"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    log = logging.getLogger("livebode.test")
    with log_output("info", own):
        log.info("first")
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (own.stat().st_size, hard))
            for _ in range(3):
                log.info("second")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        log.info("third")
    assert capsys.readouterr().err.count("cannot be written") == 1
    assert "third" in own.read_text()


def test_a_log_file_is_of_bounded_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebode.cli.log_output.FILE_BYTES_MAX", 10_000)
    log = logging.getLogger("livebode.test")
    with log_output("info", tmp_path / "own.log"):
        for number in range(1000):
            log.info("line %d", number)
    assert sum(os.path.getsize(path) for path in tmp_path.iterdir()) <= 20_000
    assert (tmp_path / "own.log").read_text().endswith("line 999\n")
