"""What may pass ends a command with 75, so that a service starts it again, and what is wrong as it is with 2."""

from __future__ import annotations

import errno
import os
import re
import shlex
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.cli.failures import exit_code_of
from livebode.core import Channel, ConfigError, LivebodeError, OutputError, RecordError, not_written
from livebode.records import Lock
from livebode.sources.live import Batch, encode_line
from livebode_plant.fleet.demo import write_simulated_fleet
from tests.support.command import RATE_HZ, Result, livebode, signals, write_csv
from tests.support.live_runs import started
from tests.support.peers.peer import PATIENCE_S, free_port
from tests.support.small_axis import SMALL_AXIS

ROOT = Path(__file__).parents[2]
UNIT = ROOT / "examples/deploy/livebode@.service"
TEMPORARY = 75
CHANNELS = (Channel("w", "A"), Channel("u", "A"), Channel("y", "rad/s"))
DATA = np.array([signals()[name] for name in "wuy"])
LINES = b"".join(
    encode_line(Batch(at, DATA[:, at : at + 40].copy(), CHANNELS, float(RATE_HZ), 9)) for at in range(0, 2000, 40)
)


def axis(folder: Path, source: str) -> Path:
    path = folder / "axis.toml"
    path.write_text(f"[source]\n{source}\n{SMALL_AXIS}")
    return path


@pytest.mark.parametrize("kind", LivebodeError.__subclasses__())
def test_what_may_pass_is_among_the_codes_of_its_class(kind: type[LivebodeError]) -> None:
    assert kind.temporary_codes <= set(kind.codes)


@pytest.mark.parametrize(
    ("number", "code"),
    [
        (errno.ENOSPC, TEMPORARY), (errno.EDQUOT, TEMPORARY), (errno.EIO, TEMPORARY), (errno.EROFS, TEMPORARY),
        (errno.EMFILE, TEMPORARY), (errno.ESTALE, TEMPORARY), (errno.EACCES, 2), (errno.EPERM, 2), (errno.ENOENT, 2),
        (errno.ENOTDIR, 2), (errno.ENAMETOOLONG, 2), (errno.EFBIG, 2),
    ],
)  # fmt: skip
def test_an_error_of_the_system_is_judged_by_its_number(number: int, code: int) -> None:
    for kind in (OutputError, RecordError):
        error = not_written(Path("run"), OSError(number, os.strerror(number)), kind)
        assert exit_code_of([error]) == exit_code_of([error.at("axis x")]) == code


def test_several_axes_end_as_the_one_for_which_a_new_start_is_worth_most() -> None:
    wrong, passes = ConfigError("key-missing", "no key"), RecordError("locked", "another process records")
    assert [exit_code_of(errors) for errors in ([], [wrong], [wrong, passes], [passes, ValueError()])] == [2, 2, 75, 1]


def in_small_file_system(folder: Path, *steps: str) -> Result:
    """Steps of a shell in a file system of 2 MB at this directory."""
    allowed = subprocess.run(["unshare", "-Urm", "true"], capture_output=True, text=True)
    if allowed.returncode:
        pytest.skip(f"this system lets a user mount no small file system: {allowed.stderr.strip()}")
    command = " && ".join([f"mount -t tmpfs -o size=2m none {shlex.quote(str(folder))}", *steps])
    done = subprocess.run(["unshare", "-Urm", "sh", "-c", command], capture_output=True, text=True, cwd=ROOT)
    return Result(done.returncode, done.stdout, done.stderr)


@pytest.mark.parametrize("moment", ["start", "end"])
def test_a_full_disk_ends_a_live_run_so_that_it_is_started_again(tmp_path: Path, moment: str) -> None:
    small = tmp_path / "small"
    small.mkdir()
    path, lines = axis(tmp_path, 'url = "stdin:"'), tmp_path / "lines"
    lines.write_bytes(LINES)
    fill = f"head -c 2m /dev/zero > {small}/full 2>/dev/null"
    livebode_ = Path(sys.executable).with_name("livebode")
    run = f"{livebode_} run {path} --out {small}/run --json"
    if moment == "start":
        done = in_small_file_system(small, f"{{ {fill}; {run} < {lines}; }}")
    else:  # full when the run has begun, before the last samples come
        wait = f"while ! test -s {small}/run/run.json; do sleep 0.1; done"
        done = in_small_file_system(
            small, f"{{ head -c 90000 {lines}; {wait}; {fill}; tail -c +90001 {lines}; }} | {run}"
        )
    assert done.code == TEMPORARY, done
    assert "the disk is full" in done.err


def test_a_directory_in_which_another_process_records_is_free_later(tmp_path: Path) -> None:
    (tmp_path / "live").mkdir()
    lock = Lock(tmp_path / "live")
    with started(axis(tmp_path, 'url = "stdin:"'), tmp_path / "live") as process:
        _, err = process.communicate(LINES, PATIENCE_S)
    lock.release()
    assert (process.returncode, b"record.locked" in err) == (TEMPORARY, True)


def test_a_port_that_another_process_has_is_free_later(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        log = write_csv(tmp_path / "log.csv", signals())
        path = axis(tmp_path, f'log = "{log}"\nfrom = "0 s"')
        done = livebode("run", path, "--out", tmp_path / "run", "--serve", "--port", taken.getsockname()[1])
    assert (done.code, "is taken" in done.err) == (TEMPORARY, True)


def test_a_log_that_does_not_answer_may_answer_later(tmp_path: Path) -> None:
    url = f"nats://127.0.0.1:{free_port()}"
    path = write_simulated_fleet(tmp_path, url, axes=1, partitions=1, workers=1)
    done = livebode("fleet", "status", path, "--json")
    assert (done.code, "fleet.log-unreachable" in done.err) == (TEMPORARY, True), done.err


def failing(number: int) -> Callable[..., Any]:
    def call(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    return call


@pytest.mark.parametrize(("number", "code"), [(errno.EIO, TEMPORARY), (errno.EACCES, 2)])
def test_an_error_of_the_disk_may_pass_and_missing_permission_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, code: int
) -> None:
    path = axis(tmp_path, f'log = "{write_csv(tmp_path / "log.csv", signals())}"')
    for call in ("mkdir", "fsync"):
        with monkeypatch.context() as patch:
            patch.setattr(os, call, failing(number))
            done = livebode("run", path, "--out", tmp_path / call)
        assert (done.code, done.err.count("\n")) == (code, 1), done.err


def test_the_service_is_started_again_after_everything_but_a_wrong_configuration() -> None:
    text = UNIT.read_text("utf-8")
    assert re.findall(r"^RestartPreventExitStatus=(.*)$", text, re.M) == ["2"]
    assert re.findall(r"^Restart=(.*)$", text, re.M) == ["on-failure"]
    assert re.findall(r"^StartLimitIntervalSec=(.*)$", text, re.M) == ["0"]  # a disk may be full for days
