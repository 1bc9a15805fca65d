"""Bad input: exit 2, one sentence with the value and the remedy, and nothing left behind."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import livebode, signals, write_csv, write_parquet

JOINT = ("--excitation", "w", "--input", "u", "--output", "y")
GRID = ("--lines", "50,100,200", "--window", "100")


def refused(tmp_path: Path, *arguments: object) -> str:
    """The sentence with which `livebode run` refuses; checks that it is one line and that nothing was left."""
    before = sorted(tmp_path.rglob("*"))
    result = livebode("run", *arguments, *(() if "--out" in arguments else ("--out", tmp_path / "run")))
    assert result.code == 2, result
    assert result.out == ""
    assert result.err.count("\n") == 1, result.err
    assert result.err.startswith("livebode: ")
    assert sorted(tmp_path.rglob("*")) == before
    return result.err


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_parquet(tmp_path / "log.parquet", signals())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--excitation", "w", "--input", "U", "--output", "y", *GRID), ("'U'", "did you mean 'u'?")),
        (("--excitation", "w", "--output", "y", *GRID), ("joint", "needs the input signal")),
        (("--excitation", "w", "--input", "u"), ("output channel is not named", "--output")),
        ((*JOINT, "--rate", 2000, *GRID), ("2000 Hz", "1000")),
        ((*JOINT, "--rate", -1, *GRID), ("source.rate_hz = -1", "greater than 0")),
        ((*JOINT, "--lines", "600", "--window", 100), ("600 Hz", "Nyquist frequency 500 Hz")),
        ((*JOINT, "--lines", "55", "--window", 100), ("55 Hz", "lines are 50 and 60 Hz", "a window of 200 samples")),
        ((*JOINT, "--lines", "fifty", "--window", 100), ("'fifty'", "20:140:20")),
        ((*JOINT, "--lines", "50,50", "--window", 100), ("bin 5 (50 Hz)", "duplicated")),
        ((*JOINT, "--lines", "50", "--window", 5000), ("2000 samples", "window of 5000")),
        ((*JOINT, "--lines", "50", "--window", 10**12), (f"lines.window = {10**12}", "less than or equal to 16777216")),
        ((*JOINT, "--lines", "10,30", "--window", 100), ("no power at 10 Hz or any other",)),
        (("--excitation", "t", "--input", "u", "--output", "y"), ("straight line",)),
        ((*JOINT, "--lines", "50", "--window", "long"), ("'long'", "auto")),
        ((*JOINT, "--lines", "50", "--window", 2), ("lines.window = 2", "greater than or equal to 3")),
        (
            (*JOINT, "--lines", "50,100,200,300", "--window", 100),
            ("'w' has no power at 300 Hz", "to 'auto'"),
        ),
        ((*JOINT, *GRID, "--hop", 0), ("tracking.hop = 0",)),
        ((*JOINT, *GRID, "--hop", 101), ("hop=101", "window of 100")),
        ((*JOINT, *GRID, "--estimator", "jiont"), ("tracking.estimator = 'jiont'", "joint")),
        ((*JOINT, *GRID, "--estimator", "indirect"), ("indirect", "controllers")),
        ((*JOINT, *GRID, "--quantity", "open loop", "--estimator", "direct"), ("loop's feedback",)),
        ((*JOINT, *GRID, "--forgetting", 2), ("tracking.forgetting = 2", "less than or equal to 1")),
        ((*JOINT, *GRID, "--difference", "z"), ("'z', which is not one of the signals in use",)),
        ((*JOINT, *GRID, "--time", "clock"), ("'clock'",)),
    ],
    ids=lambda value: " ".join(map(str, value)) if isinstance(value, tuple) else None,
)
def test_contradictory_options_are_refused_in_one_sentence(
    log: Path, tmp_path: Path, arguments: tuple, message: tuple
) -> None:
    sentence = refused(tmp_path, log, *arguments)
    for part in message:
        assert part in sentence


def spoiled(channel: str, change: object) -> dict[str, np.ndarray]:
    columns = signals()
    columns[channel] = change(columns[channel])
    return columns


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (spoiled("u", lambda u: np.full_like(u, 3.25)), ("'u' is constant at 3.25",)),
        (spoiled("y", lambda y: np.full_like(y, np.nan)), ("'y' is empty", "none of its samples is a finite number")),
        (spoiled("t", lambda t: t[::-1].copy()), ("time", "sample 1")),
        (spoiled("t", lambda t: np.where(np.arange(t.size) == 900, t - 0.01, t)), ("sample 900",)),
        (spoiled("w", lambda w: np.random.default_rng(2).standard_normal(w.size)), ("'w' does not repeat",)),
    ],
    ids=["constant", "empty", "backwards", "a step back", "noise as excitation"],
)
def test_unusable_recordings_are_refused_in_one_sentence(tmp_path: Path, columns: dict, message: tuple) -> None:
    sentence = refused(tmp_path, write_parquet(tmp_path / "log.parquet", columns), *JOINT, *GRID)
    for part in message:
        assert part in sentence


def test_lines_are_not_found_in_noise(tmp_path: Path) -> None:
    columns = spoiled("w", lambda w: np.random.default_rng(2).standard_normal(w.size))
    assert "repeat" in refused(tmp_path, write_parquet(tmp_path / "log.parquet", columns), *JOINT)


def test_missing_empty_and_damaged_recordings_are_refused(log: Path, tmp_path: Path) -> None:
    assert "no file" in refused(tmp_path, tmp_path / "nothing.csv", *JOINT, *GRID)
    assert "directory" in refused(tmp_path, tmp_path, *JOINT, *GRID)
    empty = tmp_path / "empty.csv"
    empty.touch()
    assert "empty" in refused(tmp_path, empty, *JOINT, *GRID)
    text = write_csv(tmp_path / "text.csv", signals(200))
    text.write_text(text.read_text().replace("\n0.1,", "\n0.1x,", 1))
    assert "0.1x" in refused(tmp_path, text, *JOINT, *GRID)
    cut = tmp_path / "cut.parquet"
    cut.write_bytes(log.read_bytes()[:-1000])
    assert "cut.parquet" in refused(tmp_path, cut, *JOINT, *GRID)
    picture = tmp_path / "log.png"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    assert "log.png" in refused(tmp_path, picture, *JOINT, *GRID)
    twice = tmp_path / "twice.csv"
    twice.write_text("t,y,y\n0,1,2\n0.001,2,3\n")
    assert "'y'" in refused(tmp_path, twice, *JOINT, *GRID)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[source", ("is not TOML",)),
        (f"[lines]\nwindow=0x{'f' * 50_000}", ("lines.window is a whole number of 200000 bits", "correct it")),
        ("[signals]\noutput='y'", ("'source' is missing",)),
        ("[source]\nlog='log.parquet'\n[signals]\noutput='y'\ninptu='u'", ("signals.inptu", "did you mean 'input'?")),
        ("[source]\nlog='log.parquet'\n[signals]\noutput=3", ("signals.output = 3",)),
        ("[source]\nlog='log.parquet'\n[signals]\noutput='y'\n[loop.position]\ngain=1\nrate_hz=1000",
         ("loop.position needs loop.velocity",)),
        ("[source]\nlog='log.parquet'\n[signals]\noutput='y'\n[loop.velocity]\ngain=1\nrate_hz=0",
         ("loop.velocity.rate_hz = 0", "greater than 0")),
        ("[source]\nlog='log.parquet'\n[signals]\noutput='y'\n[loop]\nexcitation_at='output'", ("controllers",)),
        ("[source]\nlog='log.parquet'\n[signals]\noutput='y'\n[loop.velocity]\ngain=nan\nrate_hz=1000",
         ("loop.velocity.gain = nan", "finite")),
        ("[source]\nlog='log.parquet'\n[signals]\noutput='y'\n[loop.velocity]\ngain=1\nrate_hz=500",
         ("loop.velocity has a rate of 500 Hz", "1000 Hz", "rate_divider")),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("log")
def test_unusable_configurations_are_refused(tmp_path: Path, text: str, message: tuple) -> None:
    axis = tmp_path / "axis.toml"
    axis.write_text(text)
    sentence = refused(tmp_path, axis, *JOINT[:4], *GRID) if "inptu" not in text else refused(tmp_path, axis)
    for part in message:
        assert part in sentence


def test_an_existing_directory_is_not_overwritten(log: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    assert livebode("run", log, *JOINT, *GRID, "--out", out).code == 0
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    assert "--force" in refused(tmp_path, log, *JOINT, *GRID, "--out", out)
    # A run that fails leaves the one before it, even when it was to be replaced.
    refused(tmp_path, log, *JOINT, "--lines", "50,300", "--window", 100, "--out", out, "--force")
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before
    assert livebode("run", log, *JOINT, *GRID, "--hop", 50, "--out", out, "--force").code == 0
    assert (out / "responses.parquet").read_bytes() != before["responses.parquet"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["log.parquet", "run"]


def test_force_does_not_remove_what_no_run_left(log: Path, tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.mkdir()
    (precious / "thesis.tex").write_text("years of work")
    assert "not the directory of a run" in refused(tmp_path, log, *JOINT, *GRID, "--out", precious, "--force")
    file = tmp_path / "file"
    file.write_text("mine")
    assert "not the directory of a run" in refused(tmp_path, log, *JOINT, *GRID, "--out", file, "--force")


def test_an_output_that_cannot_be_written_is_reported(log: Path, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    assert "could not be written" in refused(tmp_path, log, *JOINT, *GRID, "--out", file / "run")


@pytest.mark.parametrize("limit", [0, 10_000, 60_000])
def test_a_full_disk_is_reported_and_leaves_no_partial_file(log: Path, tmp_path: Path, limit: int) -> None:
    # A limit on file size makes write() fail as a full disk does, only with another error number.
    before = sorted(tmp_path.rglob("*"))
    command = [str(Path(sys.executable).with_name("livebode")), "run", str(log), *JOINT, *GRID, "--hop", "1", "--out",
               str(tmp_path / "run")]  # fmt: skip

    def limited() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    done = subprocess.run(
        command, capture_output=True, text=True, check=False, preexec_fn=limited,
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "could not be written" in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


def test_gaps_everywhere_leave_nothing_to_show(tmp_path: Path) -> None:
    columns = signals()
    columns["y"][::60] = np.nan
    sentence = refused(tmp_path, write_parquet(tmp_path / "log.parquet", columns), *JOINT, *GRID)
    assert "no stretch of 100 samples" in sentence
    assert "34 samples that are not finite" in sentence


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_run_that_is_ended_leaves_nothing(tmp_path: Path, number: signal.Signals) -> None:
    # Ended where the pictures are drawn: everything but the last step is written by then.
    log = write_parquet(tmp_path / "log.parquet", signals())
    before = sorted(tmp_path.rglob("*"))
    code = (
        "import os, signal, sys; import livebode.pictures as r; from livebode.cli import main\n"
        # What starts the tests in the background may have told them to ignore it.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"r.save_pictures = lambda *a, **k: os.kill(os.getpid(), {int(number)})\n"
        f"sys.argv = ['livebode', 'run', {str(log)!r}, *{[*JOINT, *GRID]!r}, '--out', {str(tmp_path / 'run')!r}]\n"
        "main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 128 + number, done.stderr
    assert "Traceback" not in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("PYTHONIOENCODING=ascii {livebode} inspect {log} --excitation w --output y", ""),
        ("PYTHONIOENCODING=ascii {livebode} run --help", ""),
        ("{livebode} inspect {log} | head -1", ""),
        ("! {livebode} inspect {log} >/dev/full", "could not be written"),
        (
            "! {livebode} run {log} --output y --input u --excitation w --out {out} --json >/dev/full",
            "could not be written",
        ),
    ],
)
def test_closed_pipes_and_unusual_terminals_end_without_a_traceback(
    log: Path, tmp_path: Path, command: str, message: str
) -> None:
    livebode_path = Path(sys.executable).with_name("livebode")
    line = command.format(livebode=livebode_path, log=log, out=tmp_path / "run")
    done = subprocess.run(["bash", "-o", "pipefail", "-c", line], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert message in done.stderr


def test_an_internal_error_ends_with_1(monkeypatch: pytest.MonkeyPatch, log: Path, tmp_path: Path) -> None:
    monkeypatch.setattr("livebode.runtime.recording.make_follower", lambda *_: 1 / 0)
    result = livebode("run", log, *JOINT, *GRID, "--out", tmp_path / "run")
    assert result.code == 1
    assert "ZeroDivisionError" in result.err
    assert "internal error" in result.err
    assert not (tmp_path / "run").exists()
