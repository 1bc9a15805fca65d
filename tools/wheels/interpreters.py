"""The interpreters of this computer that livebode supports."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from packaging.specifiers import SpecifierSet
from packaging.version import Version

ROOT = Path(__file__).parents[2]
_ASKED = "import sys, sysconfig; print(sys.version.split()[0], sysconfig.get_config_var('Py_GIL_DISABLED') or 0)"


@dataclass(frozen=True, order=True)
class Interpreter:
    version: Version
    is_free_threaded: bool
    path: Path

    @property
    def name(self) -> str:
        return f"{self.version.major}.{self.version.minor}{'t' if self.is_free_threaded else ''}"


def interpreters() -> list[Interpreter]:
    """One interpreter of each supported Python (3.11, 3.12, 3.13t, …), lowest first."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    supported = SpecifierSet(settings["project"]["requires-python"])
    found = (one for path in _paths() if (one := _asked(path)) and one.version in supported)
    return sorted({one.name: one for one in sorted(found)}.values())


def _paths() -> Iterator[Path]:
    yield Path(sys.base_prefix) / "bin/python3"
    for minor in range(11, 30):
        for suffix in ("", "t"):
            path = shutil.which(f"python3.{minor}{suffix}")
            if path:
                yield Path(path)
    yield from Path.home().glob(".pyenv/versions/*/bin/python3")
    yield from Path.home().glob(".local/share/uv/python/*/bin/python3")


def _asked(path: Path) -> Interpreter | None:
    done = subprocess.run([path, "-c", _ASKED], capture_output=True, text=True)
    if done.returncode:
        return None  # the name of a Python that is not installed
    version, is_free_threaded = done.stdout.split()
    return Interpreter(Version(version), is_free_threaded == "1", path)
