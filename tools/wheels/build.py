"""Builds the wheels: one for 3.11, one of the stable ABI for 3.12 and later, one for each free-threaded Python."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from tools.wheels.interpreters import ROOT, Interpreter

TOOLS = Path(sys.executable).parent


def builders(found: Iterable[Interpreter]) -> list[Interpreter]:
    """The interpreters that a wheel is built with; one of the stable ABI serves all later versions."""
    built: dict[str, Interpreter] = {}
    for one in found:
        is_own = one.is_free_threaded or one.version.minor == 11
        built.setdefault(one.name if is_own else "abi3", one)
    return list(built.values())


def build(interpreter: Interpreter, folder: Path) -> Path:
    """Build a wheel, audited and with the tag of the oldest glibc that has what it uses."""
    with tempfile.TemporaryDirectory() as place:
        _run(
            TOOLS / "uv", "build", "--wheel", "--quiet", "--python", interpreter.path, "--out-dir", place,
            "--build-constraints", ROOT / "requirements-dev.lock", "--require-hashes", ROOT,
        )  # fmt: skip
        (plain,) = Path(place).glob("*.whl")
        if "-abi3-" in plain.name:
            _run(TOOLS / "abi3audit", "--strict", "--summary", plain)
        repaired = Path(place) / "repaired"
        _run(TOOLS / "auditwheel", "repair", "--wheel-dir", repaired, plain)
        (wheel,) = repaired.glob("*.whl")
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(wheel, folder / wheel.name))


def _run(*command: str | Path) -> None:
    path = f"{TOOLS}{os.pathsep}{os.environ['PATH']}"  # auditwheel looks for patchelf there
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"PATH": path})
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, command))} failed:\n{done.stdout}{done.stderr}")
