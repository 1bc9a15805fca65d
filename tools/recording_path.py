"""Which files of livebode the name of a recording passes through in `livebode run` until its samples are read.

`python -m tools.recording_path RECORDING OPTIONS` runs the command with a profiler's hook. Each function of livebode
that gets the name, itself or inside of an argument, is a step. The steps end with the first Block.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).parents[1]
_DEPTH = 3
"""Levels of attributes, lists and dictionaries in which the name is looked for."""


@dataclass(frozen=True)
class RunTrace:
    """Files (`package/module.py`) in the order of the calls, and number of livebode's modules loaded at the end."""

    files: list[str]
    modules: int

    def upwards(self) -> int:
        """Number of steps from a package to one on a higher floor, as a callback makes them."""
        floors = [_floors().get(name.split("/")[0], 0) for name in self.files]
        return sum(after < before for before, after in pairwise(floors))


def traced_run() -> RunTrace:
    """Trace of a run of an example, in a process and a directory of its own."""
    from livebode.interface import write_examples  # not above: the process of the trace loads only what the run needs

    with tempfile.TemporaryDirectory() as folder:
        write_examples(["standstill"], Path(folder))
        options = ["--excitation", "w", "--input", "u", "--output", "velocity", "--average", "--out", f"{folder}/run"]
        command = [sys.executable, "-m", "tools.recording_path", f"{folder}/standstill.csv", *options]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return RunTrace(**json.loads(done.stderr.splitlines()[-1]))


@cache
def _floors() -> dict[str, int]:
    """Number of each package's floor from the top, of the contract in pyproject.toml."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    return {name: number for number, floor in enumerate(layers) for name in floor.split(" | ")}


def _has(value: Any, name: str, depth: int = _DEPTH) -> bool:
    if isinstance(value, str | Path):
        return str(value).endswith(name)
    if depth == 0:
        return False
    if isinstance(value, tuple | list):
        return any(_has(one, name, depth - 1) for one in value)
    if isinstance(value, dict):
        return any(_has(one, name, depth - 1) for one in value.values())
    inside = vars(value) if type(value).__module__.startswith("livebode") and hasattr(value, "__dict__") else {}
    return any(_has(one, name, depth - 1) for one in inside.values())


def _record(recording: str, files: list[str]) -> None:
    """Hook into every call from here to the first Block."""
    source = f"{ROOT}/src/livebode/"

    def called(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(source):
            return
        if code.co_qualname.startswith("Block.__"):
            sys.setprofile(None)
        given = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        if any(_has(frame.f_locals.get(name), Path(recording).name) for name in given):
            files.append(code.co_filename.removeprefix(source))

    sys.setprofile(called)


if __name__ == "__main__":
    from livebode.cli import main

    files: list[str] = []
    sys.argv[1:1] = ["run"]
    _record(sys.argv[2], files)
    try:
        main()
    finally:
        modules = len([name for name in sys.modules if name.split(".")[0] == "livebode"])
        print(json.dumps({"files": files, "modules": modules}), file=sys.stderr)
