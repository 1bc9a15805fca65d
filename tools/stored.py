"""Results of slow programs that depend on nothing but their input: stored in the environment for later processes.

A file has the hash of all that its content depends on as its name. What was not read for a week is removed.
"""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[1]
OF_KERNEL = ("kernel", "native", "examples/drive/mps2")
"""All that an object of kernel/ or native/ includes, apart from what belongs to its compiler."""
_UNUSED_S = 7 * 86400.0


def stored(key: str, make: Callable[[Path], object]) -> Path:
    """The file of a key; `make` writes it to a path if there is none. Not to be changed."""
    file = _folder() / sha256(key.encode()).hexdigest()
    with file.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # a second process that needs it waits for the first
        if not file.exists():
            new = file.with_suffix(f".{os.getpid()}")
            make(new)
            new.rename(file)
    os.utime(file)
    return file


def compiled(compiler: str, flags: list[str], source: Path) -> Path:
    """The object of a source in kernel/ or native/.

    Raises
    ------
    RuntimeError
        If it cannot be compiled, with what the compiler printed.
    """
    command = [compiler, *flags, "-c", str(source)]

    def make(file: Path) -> None:
        done = subprocess.run([*command, "-o", str(file)], capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{' '.join(command)}\n{done.stdout}{done.stderr}")

    return stored("\0".join([version(compiler), state(*OF_KERNEL), *command]), make)


@cache
def version(program: str) -> str:
    """What a program prints about its version."""
    return subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout


@cache
def state(*folders: str) -> str:
    """Hash of all sources in C and files of CMake in these folders of the repository."""
    state = sha256()
    for path in sorted(path for name in folders for path in (ROOT / name).rglob("*")):
        if path.suffix in (".c", ".h", ".cmake") or path.name == "CMakeLists.txt":
            state.update(b"%s\0%d\0" % (str(path).encode(), path.stat().st_size) + path.read_bytes())
    return state.hexdigest()


@cache
def _folder() -> Path:
    folder = Path(sys.prefix) / ".stored"
    folder.mkdir(exist_ok=True)
    for path in folder.iterdir():
        with suppress(FileNotFoundError):  # another process removes it too
            if path.stat().st_mtime < time.time() - _UNUSED_S:
                path.unlink()
    return folder
