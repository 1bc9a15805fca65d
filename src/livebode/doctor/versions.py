"""Versions of what a run depends on."""

from __future__ import annotations

import platform
import sys
from importlib.metadata import distributions
from typing import Any

from livebode import __version__
from livebode.kernel import instruction_sets


def versions() -> dict[str, Any]:
    """livebode, Python, the system, the kernel's instruction sets, and every installed package."""
    packages = {found.metadata["Name"]: found.version for found in distributions() if found.metadata["Name"]}
    return {
        "livebode": __version__,
        "python": sys.version,
        "system": platform.platform(),
        "machine": platform.machine(),
        "instruction_sets": list(instruction_sets()),
        "packages": dict(sorted(packages.items(), key=lambda item: item[0].lower())),
    }
