"""The facts of a release in the files of a repository."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path
from typing import Any

PACKAGE = "src/livebode/version.py"
DATED = re.compile(r"^## \[(?P<version>[^\]]+)\] - (?P<date>\d{4}-\d\d-\d\d)$", re.M)


def text(root: Path, name: str) -> str:
    """The content of a file, empty if it does not exist."""
    path = root / name
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def git(root: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else ""


def project(root: Path) -> dict[str, Any]:
    """pyproject.toml."""
    return tomllib.loads(text(root, "pyproject.toml"))


def version(root: Path) -> str:
    return str(project(root)["project"]["version"])


def version_in_package(root: Path) -> str:
    """`livebode.__version__`, empty if the module lacks it."""
    found = re.search(r'^__version__ = "(.*)"$', text(root, PACKAGE), re.M)
    return found.group(1) if found else ""


def section(root: Path, heading: str) -> str:
    """What CHANGELOG.md has below the heading that begins with `## [heading]`."""
    found = re.search(rf"^## \[{re.escape(heading)}\][^\n]*\n(.*?)(?=^## |\Z)", text(root, "CHANGELOG.md"), re.M | re.S)
    return found.group(1).strip() if found else ""


def newest_heading(root: Path) -> tuple[str, str]:
    """Version and date of the newest released heading of CHANGELOG.md, empty if there is none."""
    found = DATED.search(text(root, "CHANGELOG.md"))
    return (found["version"], found["date"]) if found else ("", "")


def citation(root: Path, key: str) -> str:
    """A value at the top level of CITATION.cff."""
    found = re.search(rf"^{key}: *[\"']?([^\"'\n]*)", text(root, "CITATION.cff"), re.M)
    return found.group(1).strip() if found else ""


def format_versions(page: str) -> dict[str, str]:
    """Versions of the file formats, from the table of docs/reference/formats.md."""
    table = page.partition("\n## Versions")[2].partition("\n## ")[0]
    return dict(re.findall(r"^\| ([^|]+?) \| (\d+) \|", table, re.M))
