"""Modules as they were before a decision, from the history of the repository: the other side of a comparison."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import ModuleType

COMMIT = "086c55e07a75c4e73a79ca3c53ada73901f823b0"
"""The last commit before the decisions."""
_ROOT = Path(__file__).parents[2]


def source(path: str) -> str:
    """Text of a file at that commit."""
    done = subprocess.run(["git", "show", f"{COMMIT}:{path}"], cwd=_ROOT, capture_output=True, text=True, check=True)
    return done.stdout


def module(path: str, text: str | None = None) -> ModuleType:
    """The module that this file was; `text` replaces its content, where what it imports has moved since."""
    name = f"former_{Path(path).stem}"
    found = ModuleType(name)
    sys.modules[name] = found  # dataclasses look their module up
    exec(compile(text or source(path), path, "exec"), found.__dict__)
    return found


def code_lines(text: str) -> int:
    """Lines that are neither empty nor a comment."""
    return sum(bool(line.strip()) and not line.strip().startswith("#") for line in text.splitlines())
