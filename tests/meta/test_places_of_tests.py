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
WINGS = [str(path.relative_to(ROOT)) for path in sorted(ROOT.glob("wings/*/src"))]
FOLDERS = sorted(path for path in TESTS.iterdir() if path.name != "meta" and any(path.glob("test_*.py")))
FOLDERS += sorted({path.parent for path in ROOT.glob("wings/*/tests/**/test_*.py")})


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
def test_the_tests_of_a_package_have_its_name(folder: str) -> None:
    assert folder in PACKAGES | {"examples", "meta", "native", "studies"}


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(ROOT)))
def test_a_test_file_is_named_by_subject_and_kind(folder: Path) -> None:
    for path in folder.iterdir():
        assert re.fullmatch(rf"test_[a-z_]+_({'|'.join(KINDS)})\.py|__pycache__|stored", path.name), path


def test_what_tests_share_is_in_support_or_twins_and_not_in_another_test_or_a_program() -> None:
    own = {"meta": PROGRAMS, "studies": PROGRAMS, "examples": PROGRAMS}
    for path in (*TESTS.rglob("*.py"), *ROOT.glob("wings/*/tests/**/*.py")):
        for name in imported(path):
            root, *rest = name.split(".")
            assert root not in PROGRAMS - own.get(path.parent.name, set()), f"{path} imports {name}"
            assert root != "tests" or rest[0] in ("support", "twins"), f"{path} imports {name}"


@pytest.mark.parametrize("folder", ["src", "tools", *sorted(PROGRAMS), *WINGS])
def test_nothing_else_imports_the_tests(folder: str) -> None:
    """A bench compares a twin with what it defines."""
    shared = "tests.twins." if folder == "bench" else "tests/"
    for path in (ROOT / folder).rglob("*.py"):
        assert not [n for n in imported(path) if n.split(".")[0] == "tests" and not n.startswith(shared)], path
