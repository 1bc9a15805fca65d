"""No package grows unnoticed, packages are imported by their faces, and a change runs the tests that it concerns."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path

from tools.changed_tests import ROOT, changed_modules, concerned
from tools.size import commands_and_options, import_depth, imports, limits, past_faces, sizes

PAST_FACES_MAX = 0.05
DEPTH_MAX, COMMANDS_MAX, OPTIONS_MAX, README_LINES_MAX = 25, 30, 292, 150


def test_each_package_is_within_its_limits() -> None:
    """Delete something, or raise the limit (`python -m tools.size --limits`) and say why in the same commit."""
    measured = {name: asdict(size) for name, size in sizes().items()}
    assert measured.keys() == limits().keys()
    over = {
        f"{name}: {value} {key}, limit {limits()[name][key]}"
        for name, size in measured.items()
        for key, value in size.items()
        if value > limits()[name][key]
    }
    assert over == set()


def test_packages_are_imported_by_their_faces() -> None:
    assert len(past_faces()) <= PAST_FACES_MAX * len(imports()), past_faces()
    assert import_depth() <= DEPTH_MAX
    example = "".join(path.read_text("utf-8") for path in (ROOT / "examples" / "plugin").rglob("*.py"))
    imported = set(re.findall(r"^(?:from|import) (livebode(?:\.\w+)*)", example, re.M))
    packages = {name: ROOT / "src" / Path(*name.split(".")) for name in imported}
    assert [name for name, folder in packages.items() if not (folder / "__init__.pyi").exists()] == []


def test_commands_options_and_the_readme_do_not_grow() -> None:
    commands, options = commands_and_options()
    assert commands <= COMMANDS_MAX
    assert options <= OPTIONS_MAX
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= README_LINES_MAX


def concerned_by(path: str) -> set[str]:
    """Names of the tests that a change of a file concerns."""
    names = concerned(changed_modules(ROOT / path))
    return {name for name in names if name.split(".")[-1].startswith("test_")}


def test_a_change_of_a_wing_runs_its_tests_and_none_of_other_wings_and_of_the_core_nearly_all() -> None:
    of_wing = concerned_by("wings/connect/src/livebode_connect/mail.py")
    assert {name for name in of_wing if not name.startswith(("wings.connect.tests.", "tests.meta."))} == set()
    assert "wings.connect.tests.test_mail_truth" in of_wing
    of_core = concerned_by("src/livebode/core/_block.py")
    assert "tests.records.test_run_directory_contract" in of_core or len(of_core) > 300
    assert concerned_by("wings/connect/tests/test_mail_truth.py") == {"wings.connect.tests.test_mail_truth"}
