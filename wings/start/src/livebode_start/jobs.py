"""Jobs: commands of livebode that a person starts in the browser, each in a process of its own."""

from __future__ import annotations

import os
import re
import secrets
import subprocess
import sys
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import field
from pathlib import Path
from typing import IO, Any, Literal

from livebode.core import ServerError
from livebode.dataclass import dataclass
from livebode.language import Message

RUNNING_MAX = 4
"""Most jobs at once."""
RETAINED_MAX = 50
"""Most jobs that are remembered, with those that run."""
LINES_MAX, LINE_LETTERS_MAX = 400, 4000
"""Of what a job printed, its last lines."""
STOP_S = 20.0
"""Time that a cancelled job has to complete what it writes; it is killed after that."""
CLOSE_S = 5.0
"""The same when the server ends."""
_COLUMNS = 100
_PROGRAM = "from livebode_start.job_process import main; main()"
_PROGRESS = re.compile(r"livebode: (\d{1,3}) % ")
_FRAMED = re.compile(r"[│|] (.*?) *[│|]")
JobState = Literal["running", "stopping", "done", "failed", "stopped"]


@dataclass(frozen=True)
class JobOrder:
    """What a job does.

    Attributes
    ----------
    task
        Name of the task, such as "learn".
    arguments
        Of the command `livebode`. They are passed to the process as they are, so each is made by the server: an option
        as one word ``--name=value``, and the names of runs and files from the listing of the server.
    prepare
        Called before the command starts, to write what it reads.
    """

    task: str
    arguments: tuple[str, ...]
    prepare: Callable[[], object] = lambda: None


@dataclass(eq=False)
class CommandJob:
    """A command that runs, or has ended.

    Attributes
    ----------
    id
        Its name for the page.
    order
        What it does.
    begun_unix_s, ended_unix_s
        Seconds since 1970; the second is None while it runs.
    code
        Exit code of the command; None while it runs.
    cancelled
        Whether a person, or the end of the server, has ended it.
    progress
        Part of the work that is done, in percent; None if the command does not say.
    """

    id: str
    order: JobOrder
    process: subprocess.Popen[bytes]
    begun_unix_s: float = field(default_factory=time.time)
    ended_unix_s: float | None = None
    code: int | None = None
    cancelled: bool = False
    progress: int | None = None
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=LINES_MAX))
    ended: threading.Event = field(default_factory=threading.Event)

    @property
    def state(self) -> JobState:
        """What it does now."""
        if self.code is None:
            return "stopping" if self.cancelled else "running"
        if self.code == 0:
            return "done"
        return "stopped" if self.cancelled else "failed"

    @property
    def sentence(self) -> str:
        """The result of the command in a sentence, or its error, without the lines around it."""
        return main_sentence(list(self.lines), failed=self.code not in (None, 0))

    def plain(self) -> dict[str, Any]:
        """For the page."""
        return {
            "id": self.id,
            "task": self.order.task,
            "state": self.state,
            "begun": self.begun_unix_s,
            "ended": self.ended_unix_s,
            "progress": self.progress,
            "code": self.code,
            "arguments": list(self.order.arguments),
            "sentence": self.sentence,
            "output": "\n".join(list(self.lines)),  # a copy: another thread adds lines
        }

    def interrupt(self) -> None:
        """End it as Ctrl-C would; what it wrote remains, as then."""
        self.cancelled = True
        assert self.process.stdin is not None
        self.process.stdin.close()

    def follow(self) -> None:
        """Read what it prints until it has ended; in a thread of its own."""
        assert self.process.stdout is not None
        assert self.process.stdin is not None
        with self.process.stdout as printed, self.process.stdin:
            _read_lines(printed, self._add)
            code = self.process.wait()
        if code < 0:
            self.lines.append(f"livebode: the command was killed by signal {-code}; what was complete is written")
        self.ended_unix_s = time.time()
        self.code = code
        self.ended.set()

    def _add(self, line: str) -> None:
        if (found := _PROGRESS.match(line)) is not None:
            self.progress = min(100, int(found[1]))
        else:
            self.lines.append(line)


class Jobs:
    """The jobs of a server; of any thread.

    Parameters
    ----------
    directory
        Working directory of the commands.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._jobs: OrderedDict[str, CommandJob] = OrderedDict()
        self._lock = threading.Lock()
        self._closed = False

    def start(self, order: JobOrder) -> CommandJob:
        """Start a command.

        Raises
        ------
        ServerError
            If as many jobs as permitted run already, or the system starts no process.
        """
        with self._lock:
            running = sum(job.code is None for job in self._jobs.values())
            if running >= RUNNING_MAX or self._closed:
                raise ServerError(
                    "busy",
                    Message("{count} jobs are running already", count=running),
                    Message("wait for one of them, or cancel it"),
                    limit=RUNNING_MAX,
                )
            order.prepare()
            job = CommandJob(secrets.token_hex(8), order, _started(order.arguments, self.directory))
            self._jobs[job.id] = job
            for old in [name for name, other in self._jobs.items() if other.code is not None]:
                if len(self._jobs) <= RETAINED_MAX:
                    break
                del self._jobs[old]
        threading.Thread(target=job.follow, name=f"livebode job {job.id}", daemon=True).start()
        return job

    def job(self, name: object) -> CommandJob:
        """The job of this name; ServerError if there is none, as after a restart of the server."""
        job = self._jobs.get(name) if isinstance(name, str) else None
        if job is None:
            raise ServerError(
                "job-unknown",
                Message("this job is not known: the server was started again, or it ended long ago"),
                Message("look for its result in the list of runs"),
            )
        return job

    def cancel(self, name: object) -> None:
        """End a job as Ctrl-C would; the second time, and 20 s after the first, kill it."""
        job = self.job(name)
        with self._lock:
            if job.code is not None:
                return
            again = job.cancelled
            job.interrupt()
        if again:
            job.process.kill()
            return
        waiting = threading.Timer(STOP_S, self._kill, [job])
        waiting.daemon = True
        waiting.start()

    def listed(self) -> list[CommandJob]:
        """All that are remembered, the newest first."""
        with self._lock:
            return list(reversed(self._jobs.values()))

    def close(self) -> None:
        """End all of them, and wait until they have ended."""
        with self._lock:
            self._closed = True
            running = [job for job in self._jobs.values() if job.code is None]
            for job in running:
                job.interrupt()
        until = time.monotonic() + CLOSE_S
        for job in running:
            if not job.ended.wait(max(0.0, until - time.monotonic())):
                self._kill(job)
                job.ended.wait(CLOSE_S)

    @staticmethod
    def _kill(job: CommandJob) -> None:
        if job.code is None:
            job.process.kill()


def main_sentence(lines: list[str], *, failed: bool) -> str:
    """The sentence of a command that a person should read, from the lines that it printed.

    >>> main_sentence(["reading", "livebode: no such file 'a.csv'; check its name"], failed=True)
    "no such file 'a.csv'; check its name"
    >>> main_sentence(["╭─ Error ────╮", "│ No such    │", "│ option     │", "╰────────────╯"], failed=True)
    'No such option'
    >>> main_sentence(["Learned from 380 windows.", "baselines/x.json", "", "Next: livebode run …"], failed=False)
    'Learned from 380 windows.'
    >>> main_sentence(["report.html", "report.pdf", "Next: livebode view …"], failed=False)
    'report.pdf'
    """
    filled = [line for line in lines if line.strip() and not line.startswith("Next: ")]  # that is for a terminal
    if failed:
        starts = [number for number, line in enumerate(filled) if line.startswith("livebode: ")]
        if starts:
            return "\n".join(filled[starts[-1] :]).removeprefix("livebode: ")
        if framed := [found[1] for line in filled if (found := _FRAMED.fullmatch(line.strip()))]:
            return " ".join(framed)
    said = [line.strip() for line in filled]
    return next((line for line in said if line.endswith(".")), said[-1] if said else "")


def _started(arguments: tuple[str, ...], directory: Path) -> subprocess.Popen[bytes]:
    # -P: a file numpy.py among the recordings is not a module. A group of its own: Ctrl-C in the terminal of the server
    # ends the server, which ends its jobs.
    words = [sys.executable, "-P", "-c", _PROGRAM, *arguments]
    surroundings = {name: value for name, value in os.environ.items() if name not in ("FORCE_COLOR", "TTY_COMPATIBLE")}
    try:
        return subprocess.Popen(
            words,
            cwd=directory,
            env=surroundings | {"PYTHONIOENCODING": "utf-8", "COLUMNS": str(_COLUMNS), "PYTHONUNBUFFERED": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
    except (OSError, ValueError) as error:  # ValueError: a character that no argument can have
        reason = getattr(error, "strerror", None) or str(error)
        raise ServerError(
            "job-not-started",
            Message("the command was not started: {reason}", reason=reason),
            Message("try again when less is running"),
        ) from None


def _read_lines(printed: IO[bytes], add: Callable[[str], None]) -> None:
    """Pass on each line, and a line without an end in parts."""
    while part := printed.readline(LINE_LETTERS_MAX):
        add(part.decode("utf-8", errors="replace").rstrip("\r\n"))
