"""`python tools/install.py LOCK`: pip installs the packages of a lock file, with a line of progress.

For the Makefile: the first `make` of a clone takes some minutes, and should say what it does. Only the standard
library, because nothing is installed yet.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections import deque
from pathlib import Path

_EVERY = 20  # packages, between two lines of a file or a pipe
_SHOWN_OF_FAILURE = 20


def install(lock: Path) -> int:
    """Install, and give pip's exit code."""
    total = len(re.findall(r"^[\w.-]+==", lock.read_text("utf-8"), re.M))
    print(f"Installing {total} packages of {lock.name} into {sys.prefix}: some minutes, once", flush=True)
    options = ["--require-hashes", "--progress-bar", "off", "--disable-pip-version-check", "-r", str(lock)]
    pip = [sys.executable, "-m", "pip", "install", *options]
    last: deque[str] = deque(maxlen=_SHOWN_OF_FAILURE)
    number = 0
    with subprocess.Popen(pip, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        for line in process.stdout or ():
            last.append(line)
            if line.startswith(("Collecting ", "Requirement already satisfied: ")):
                number += 1
                _show(f"[{number}/{total}] {line.split(': ')[-1].removeprefix('Collecting ').split()[0]}", number)
            elif line.startswith("Installing collected packages"):
                _show("writing the packages", 0)
    if sys.stdout.isatty():
        print()
    if process.returncode:
        print("".join(last), file=sys.stderr)
    return process.returncode


def _show(text: str, number: int) -> None:
    if sys.stdout.isatty():
        print(f"\r{text:<60}", end="", flush=True)
    elif number % _EVERY == 0:
        print(text, flush=True)


if __name__ == "__main__":
    sys.exit(install(Path(sys.argv[1])))
