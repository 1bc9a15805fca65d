"""Hides what Windows does not have: `python -m tests.support.windows_like TASK …` then does a task.

`msvcrt` is a stand-in on flock: as there, a lock belongs to an open file, and ends with the process.
"""

from __future__ import annotations

import errno
import fcntl
import importlib
import os
import pkgutil
import select
import selectors
import shutil
import signal
import socket
import subprocess  # which, like asyncio, takes the stand-in for Windows if it is imported later
import sys
import time
import traceback
import types
from pathlib import Path
from typing import Any

assert subprocess
assert selectors
WINGS = Path(__file__).parents[2] / "wings"
MODULES = ("fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "syslog", "readline", "posix_ipc", "spwd")
OF_OS = (
    "fork", "forkpty", "getuid", "geteuid", "getgid", "getegid", "setuid", "chown", "lchown", "fchown", "fchmod",
    "statvfs", "fstatvfs", "mkfifo", "mknod", "nice", "setsid", "killpg", "getpgid", "pread", "pwrite", "preadv",
    "fdatasync", "posix_fallocate", "posix_fadvise", "sched_getaffinity", "getloadavg", "sync", "writev",
    "O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_DIRECTORY", "O_SYNC", "O_DSYNC",
)  # fmt: skip
OF_SIGNAL = (
    "SIGHUP",
    "SIGUSR1",
    "SIGUSR2",
    "SIGALRM",
    "SIGPIPE",
    "setitimer",
    "pthread_sigmask",
    "sigwait",
    "pthread_kill",
)
OF_TIME = ("clock_gettime", "clock_getres", "CLOCK_BOOTTIME", "CLOCK_MONOTONIC", "pthread_getcpuclockid", "tzset")


def hide() -> None:
    """Remove the names, before anything of livebode is imported; directories cannot be opened any more."""
    flock, exclusive = fcntl.flock, fcntl.LOCK_EX | fcntl.LOCK_NB

    def locking(file: int, mode: int, size: int) -> None:
        assert (mode, size) == (2, 1)
        try:
            flock(file, exclusive)
        except BlockingIOError:
            raise PermissionError(errno.EACCES, "Permission denied") from None

    sys.modules["msvcrt"] = types.ModuleType("msvcrt")
    vars(sys.modules["msvcrt"]).update(locking=locking, LK_NBLCK=2)
    for name in MODULES:
        sys.modules[name] = None  # type: ignore[assignment]
    for module, names in ((os, OF_OS), (signal, OF_SIGNAL), (time, OF_TIME)):
        for name in names:
            if hasattr(module, name):
                delattr(module, name)
    shutil._use_fd_functions = False  # type: ignore[attr-defined]
    opened = os.open

    def open_file(path: str, flags: int, mode: int = 0o777, *, dir_fd: int | None = None) -> int:
        if dir_fd is None and os.path.isdir(path):
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return opened(path, flags, mode, dir_fd=dir_fd)

    os.open = open_file  # type: ignore[assignment]
    _hide_polling()


def _hide_polling() -> None:
    """`select` waits for sockets only."""
    chosen = select.select

    def of_sockets(*waits: Any) -> Any:
        if any(not isinstance(file, socket.socket) for files in waits[:3] for file in files):
            raise OSError(10038, "an operation was attempted on something that is not a socket")
        return chosen(*waits)

    select.select = of_sockets
    for name in ("poll", "epoll", "POLLRDHUP"):
        delattr(select, name)


def import_all() -> None:
    """Import every module of livebode and its wings."""
    import livebode

    packages = [livebode, *(importlib.import_module(path.name) for path in sorted(WINGS.glob("*/src/livebode_*")))]
    for package in packages:
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            try:
                importlib.import_module(module.name)
            except livebode.ExtraError as error:  # a package that nobody needs to test this
                print(error, file=sys.stderr)
            except ImportError as error:
                # Other packages are those for this system; psutil, for example, imports `resource` on Linux only.
                if "site-packages" not in traceback.extract_tb(error.__traceback__)[-1].filename:
                    raise
                print(error, file=sys.stderr)
            print(module.name)


def job() -> None:
    """A job of the start page, as its server starts one; ends when standard input is closed."""
    from livebode_start.job_process import main

    main()


def run() -> None:
    """The command line."""
    from livebode.cli import main

    main()


def use() -> None:
    """What the page on Windows states."""
    import shlex

    from livebode import Run
    from livebode.cli.app import app
    from livebode.core import RecordError
    from livebode.records import Lock

    roles = "--excitation w --input u --output velocity"
    for command in (
        "example standstill --out .",
        f"inspect standstill.csv {roles.replace('--input u ', '')}",
        "run standstill.toml",
        f"run standstill.csv {roles} --out runs/segments --continue",
        "fit runs/segments",
        "report runs/standstill",
        "export runs/segments --to csv",
    ):
        app(shlex.split(command), standalone_mode=False)
    assert Run("runs/segments").finished
    assert not list(Path("runs").glob(".*"))
    lock = Lock(Path("runs/segments"))
    try:
        Lock(Path("runs/segments"))
    except RecordError as error:
        print(error.code)
    lock.release()
    Lock(Path("runs/segments")).release()


if __name__ == "__main__":
    hide()
    task, sys.argv[1:] = sys.argv[1], sys.argv[2:]
    {"use": use, "import": import_all, "job": job, "run": run}[task]()
