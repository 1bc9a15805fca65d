"""Sets the version of the next release in every file that has it."""

from __future__ import annotations

import re
from pathlib import Path

from packaging.version import Version

from tools.release.files import PACKAGE, section, text

RECIPE = "examples/deploy/conda/meta.yaml"


def replaced(content: str, pattern: str, replacement: str, name: str) -> str:
    new, count = re.subn(pattern, replacement, content, count=1, flags=re.M)
    if not count:
        raise ValueError(f"{name} has no line {pattern!r}")
    return new


def prepare(root: Path, version: str, date: str) -> list[str]:
    """Write version and date to every file that has them; return what was written."""
    version = str(Version(version))
    if not section(root, "Unreleased"):
        raise ValueError("the Unreleased part of CHANGELOG.md is empty: there is nothing to release")
    cff = text(root, "CITATION.cff")
    if not re.search(r"^date-released:", cff, re.M):
        cff = replaced(cff, r"^(version:.*)$", r"\1\ndate-released:", "CITATION.cff")
    cff = replaced(cff, r"^version:.*$", f"version: {version}", "CITATION.cff")
    heading = f"## [Unreleased]\n\n## [{version}] - {date}"
    contents = {
        "pyproject.toml": replaced(
            text(root, "pyproject.toml"), r'^version = ".*"$', f'version = "{version}"', "pyproject.toml"
        ),
        PACKAGE: replaced(text(root, PACKAGE), r'^__version__ = ".*"$', f'__version__ = "{version}"', PACKAGE),
        RECIPE: replaced(
            text(root, RECIPE), '^{% set version = ".*" %}$', f'{{% set version = "{version}" %}}', RECIPE
        ),
        "CITATION.cff": replaced(cff, r"^date-released:.*$", f"date-released: {date}", "CITATION.cff"),
        "CHANGELOG.md": replaced(text(root, "CHANGELOG.md"), r"^## \[Unreleased\]$", heading, "CHANGELOG.md"),
    }
    for name, content in contents.items():
        (root / name).write_text(content, encoding="utf-8")
    return list(contents)
