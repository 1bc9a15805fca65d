"""Several commands in one process in which packages are absent or others are installed."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

PROGRAM = """
import contextlib, io, json, sys
for name in {absent!r}:
    sys.modules[name] = None
sys.path[:0] = {path!r}
from livebode.cli import main
answers = []
for words in {commands!r}:
    sys.argv = ["livebode", *words]
    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    answers.append((code, out.getvalue(), err.getvalue()))
print(json.dumps(answers))
"""


class Answer(NamedTuple):
    """Exit code, standard output and standard error of a command."""

    code: int
    out: str
    err: str


def answers(
    *commands: Sequence[object], absent: Iterable[str] = (), path: Iterable[Path] = (), folder: Path | None = None
) -> list[Answer]:
    """The answer to each of the commands (words after `livebode`), in their order.

    `absent` cannot be imported, `path` has further packages, and the process starts in `folder`.
    """
    words = [list(map(str, command)) for command in commands]
    code = PROGRAM.format(absent=list(absent), path=list(map(str, path)), commands=words)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return [Answer(*answer) for answer in json.loads(done.stdout.splitlines()[-1])]
