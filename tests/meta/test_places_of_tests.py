"""Where tests are, what they are called and what they import (docs/explanation/architecture.md)."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
PACKAGES = {path.parent.name for path in (ROOT / "src/livebode").glob("*/__init__.py")}
KINDS = ("contract", "property", "truth", "reference", "fault")
PROGRAMS = {"bench", "examples", "studies"}


def imported(path: Path) -> Iterator[str]:
    """Dotted names of the modules of this repository's other folders that a file imports, and of what it imports."""
    text = path.read_text()
    if not re.search(r"^ *(from|import) (tests|bench|examples|studies)\b", text, re.M):
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("folder", sorted(path.name for path in TESTS.iterdir() if any(path.glob("test_*.py"))))
def test_a_test_file_is_named_by_package_subject_and_kind(folder: str) -> None:
    if folder == "meta":
        return
    assert folder in PACKAGES | {"examples", "studies"}
    for path in (TESTS / folder).iterdir():
        assert re.fullmatch(rf"test_[a-z_]+_({'|'.join(KINDS)})\.py|__pycache__|stored", path.name), path


def test_what_tests_share_is_in_support_and_not_in_another_test_or_a_program() -> None:
    own = {"meta": PROGRAMS, "studies": PROGRAMS, "examples": PROGRAMS}
    for path in TESTS.rglob("*.py"):
        for name in imported(path):
            root, *rest = name.split(".")
            assert root not in PROGRAMS - own.get(path.parent.name, set()), f"{path} imports {name}"
            assert root != "tests" or rest[0] == "support", f"{path} imports {name}"


@pytest.mark.parametrize("folder", ["src", "tools", *sorted(PROGRAMS)])
def test_nothing_else_imports_the_tests(folder: str) -> None:
    for path in (ROOT / folder).rglob("*.py"):
        assert not [name for name in imported(path) if name.split(".")[0] == "tests"], path
