"""Jobs that end otherwise than by themselves: cancelled, killed, refused, with their server."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import ServerError
from livebode.records import RunRecord
from livebode_start.jobs import RUNNING_MAX, CommandJob, JobOrder, Jobs
from livebode_start.workspace import file_name
from tests.support.browser import until
from tests.support.command import livebode, signals, write_csv

DEMO = JobOrder("run", ("demo", "--seconds=600", "--out=demo"))
"""Ten minutes of a simulated axis, in real time."""
LIVE = JobOrder("run", ("run", "axis.toml", "--out=live"))
"""A file that is followed: samples at once, and then none."""
AXIS = """
source = {log = "log.csv", follow = true, rate_hz = 1000}
signals = {excitation = "w", input = "u", output = "y"}
lines = {frequencies = "50,100,200", window = 100}
record = {samples = true}
"""


@pytest.fixture
def jobs(tmp_path: Path) -> Iterator[Jobs]:
    started = Jobs(tmp_path)
    yield started
    started.close()


def ended(job: CommandJob) -> CommandJob:
    assert job.ended.wait(60), job.plain()
    return job


def live(directory: Path) -> None:
    """What the order LIVE reads."""
    write_csv(directory / "log.csv", signals())
    (directory / "axis.toml").write_text(AXIS)


def has_responses(directory: Path) -> bool:
    return (directory / "run.json").exists() and len(RunRecord.open(directory).responses()) > 0


def runs(process: int) -> bool:
    """Whether a process of Linux has not ended; nobody may have asked for its code."""
    status = Path(f"/proc/{process}/stat")
    return status.exists() and status.read_text().rpartition(")")[2].split()[0] != "Z"


def test_what_a_job_prints_is_what_the_terminal_shows(jobs: Jobs, tmp_path: Path) -> None:
    job = ended(jobs.start(JobOrder("doctor", ("inspect", "absent.csv"))))
    assert job.state == "failed"
    assert f"livebode: {job.sentence}\n" == livebode("inspect", "absent.csv").err
    assert ended(jobs.start(JobOrder("help", ("--version",)))).sentence == livebode("--version").out.strip()
    assert not list(tmp_path.iterdir())


def test_a_wrong_option_is_one_sentence(jobs: Jobs) -> None:
    job = ended(jobs.start(JobOrder("run", ("inspect", "--rate=much", "a.csv"))))
    assert job.state == "failed"
    assert job.sentence.startswith("Invalid value for '--rate': ")
    assert "│" not in job.sentence
    assert "\n" not in job.sentence


def test_a_cancelled_live_run_is_complete(jobs: Jobs, tmp_path: Path) -> None:
    live(tmp_path)
    job = jobs.start(LIVE)
    until(lambda: has_responses(tmp_path / "live"), "the record", 60)
    jobs.cancel(job.id)
    assert ended(job).state == "done", job.plain()
    assert job.code == 0
    assert has_responses(tmp_path / "live")


@pytest.mark.parametrize("after_s", [0.0, 0.05, 0.2, 0.5, 1.0])
def test_a_job_that_is_cancelled_while_it_starts_says_what_ctrl_c_would(jobs: Jobs, after_s: float) -> None:
    job = jobs.start(DEMO)
    time.sleep(after_s)
    jobs.cancel(job.id)
    assert ended(job).state == "stopped"
    assert job.sentence in ("stopped; nothing was written", "stopped; no file is half written")


def test_a_killed_job_says_so_and_another_one_can_start(jobs: Jobs) -> None:
    job = jobs.start(DEMO)
    job.process.kill()
    assert ended(job).state == "failed"
    assert "killed by signal 9" in job.sentence
    assert ended(jobs.start(JobOrder("help", ("--version",)))).state == "done"


def test_a_job_that_does_not_react_is_killed_by_the_second_cancel(jobs: Jobs) -> None:
    job = jobs.start(DEMO)
    os.kill(job.process.pid, signal.SIGSTOP)
    jobs.cancel(job.id)
    assert job.state == "stopping"
    jobs.cancel(job.id)
    assert ended(job).state == "stopped"


def test_only_so_many_run_at_once_and_each_ends_with_the_server(jobs: Jobs) -> None:
    started = [jobs.start(JobOrder("run", ("demo", "--seconds=600", f"--out=d{k}"))) for k in range(RUNNING_MAX)]
    with pytest.raises(ServerError, match=f"{RUNNING_MAX} jobs are running already"):
        jobs.start(DEMO)
    jobs.close()
    assert all(ended(job).process.poll() is not None for job in started)
    with pytest.raises(ServerError):
        jobs.start(DEMO)


_SERVER = """
import sys, time
from pathlib import Path
from livebode_start.jobs import JobOrder, Jobs
job = Jobs(Path(sys.argv[1])).start(JobOrder("run", ("run", "axis.toml", "--out=live")))
print(job.process.pid, flush=True)
time.sleep(600)
"""


def test_a_job_ends_in_order_when_its_server_is_killed(tmp_path: Path) -> None:
    live(tmp_path)
    # As nohup does, the server ignores Ctrl-C; its jobs must not.
    server = subprocess.Popen(
        [sys.executable, "-c", _SERVER, str(tmp_path)],
        stdout=subprocess.PIPE, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )  # fmt: skip
    assert server.stdout is not None
    with server.stdout:
        job = int(server.stdout.readline())
        until(lambda: has_responses(tmp_path / "live"), "the record", 60)
        server.kill()
        server.wait()
    until(lambda: not runs(job), "the end of the job", 60)
    assert (tmp_path / "live" / "bode.svg").exists()  # the last thing that a run writes


def test_a_file_among_the_recordings_is_not_run_as_a_module(jobs: Jobs, tmp_path: Path) -> None:
    for name in ("numpy.py", "typer.py", "livebode_start.py", "sitecustomize.py"):
        (tmp_path / name).write_text("open('executed', 'w')\n")
    assert ended(jobs.start(JobOrder("help", ("inspect", "--help")))).state == "done"
    assert not (tmp_path / "executed").exists()


@pytest.mark.parametrize("letter", ["\0", "\ud800"])
def test_an_argument_that_no_process_can_have_is_refused(jobs: Jobs, letter: str) -> None:
    with pytest.raises(ServerError, match="the command was not started"):
        jobs.start(JobOrder("report", ("report", f"--machine={letter}")))
    assert jobs.listed() == []


def test_a_job_of_an_earlier_server_is_not_known(jobs: Jobs) -> None:
    for name in ("0123", None, 5, ["a"]):
        with pytest.raises(ServerError, match="look for its result in the list of runs"):
            jobs.job(name)


@given(
    st.text(max_size=80) | st.sampled_from(["..", "../a", "a/b", "a\\b", "C:a", "nul", "CON.toml", "a.", "-x", "a\0"])
)
def test_a_name_is_one_file_of_the_directory_on_every_system(text: str) -> None:
    try:
        name = file_name(text)
    except ServerError:
        return
    assert Path("/w", name).resolve().parent == Path("/w")
    assert not set(name) & set('/\\:*?"<>|\0\n')
    assert name[0] not in ".- "
    assert name[-1] not in ". "
    assert len(name.encode()) <= 64
