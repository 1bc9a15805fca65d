"""The figure of docs/monitoring.md."""

from __future__ import annotations
from pathlib import Path
from livebode.monitoring import Machine


def draw(machine: Machine, path: Path) -> None:
    del machine, path
