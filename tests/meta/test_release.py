"""The check-list of a release: each check misses on a repository with exactly its fault."""

from __future__ import annotations

import json
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from tools.command_line import page as command_page
from tools.configuration import page as configuration_page
from tools.error_codes import page as error_page
from tools.release.__main__ import run
from tools.release.builds import BUNDLE, metadata_fault, wheel_fault
from tools.release.checks import CHECKS
from tools.release.prepare import prepare

LOCK = "numpy==2.1.0 \\\n    --hash=sha256:00\nruff==0.9.0\nsphinx==8.2.0\nnumba==0.61\n"
FORMATS = (
    "# File formats\n\n## Versions\n\n| format | version | where |\n|---|---|---|\n| run directory | {} | run.json |\n"
)
FILES = {
    "pyproject.toml": '[project]\nname = "livebode"\nversion = "1.2.0"\ndependencies = ["numpy>=2.0"]\n'
    '[dependency-groups]\ndev = ["ruff>=0.8"]\ndocs = ["sphinx>=8.2"]\nbench = ["numba>=0.61"]\n'
    'wheels = []\n',
    "CHANGELOG.md": "# Changelog\n\n## [Unreleased]\n\n## [1.2.0] - 2026-02-03\n\n- Faster.\n\n"
    "## [1.1.0] - 2026-01-01\n\n- Old.\n",
    "CITATION.cff": "title: livebode\nversion: 1.2.0\ndate-released: 2026-02-03\nreferences:\n  - year: 2016\n",
    "src/livebode/version.py": '__version__ = "1.2.0"\n',
    "examples/deploy/conda/meta.yaml": '{% set version = "1.2.0" %}\n',
    "LICENSE": "MIT", "NOTICE": "uPlot, src/livebode/dashboard/_vendor/uplot\n",
    "src/livebode/dashboard/_vendor/uplot/LICENSE": "MIT",
    "package-lock.json": "{}", **dict.fromkeys(("requirements-dev.lock", "requirements-bench.lock"), LOCK),
    "requirements-docs.lock": LOCK, "requirements-wheels.lock": LOCK,
    "docs/reference/formats.md": FORMATS.format(2), "tests/records/stored/2/expected.json": "{}",
    "docs/reference/command-line.md": command_page(), "docs/reference/errors.md": error_page(),
    "docs/reference/configuration.md": configuration_page(),
    "bench/history/1.2.0.json": json.dumps({"livebode": "1.2.0"}),
}  # fmt: skip


def git(root: Path, *words: str) -> None:
    identity = ("-c", "user.name=livebode", "-c", "user.email=livebode", "-c", "commit.gpgsign=false")
    subprocess.run(["git", *identity, *words], cwd=root, check=True, capture_output=True)


def write(root: Path, name: str, content: str) -> None:
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text(content, encoding="utf-8")


@pytest.fixture(scope="module")
def ready(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small repository in which every check is ok; 1.1.0 had the formats in version 2, too."""
    root = tmp_path_factory.mktemp("ready")
    for name, content in FILES.items():
        write(root, name, content)
    git(root, "init", "--initial-branch=main")
    git(root, "add", ".")
    git(root, "commit", "--message=First")
    git(root, "tag", "v1.1.0")
    return root


def edited(name: str, old: str, new: str) -> Callable[[Path], None]:
    def edit(root: Path) -> None:
        assert old in (root / name).read_text()
        write(root, name, (root / name).read_text().replace(old, new))
        git(root, "commit", "--all", "--message=Fault")

    return edit


def removed(name: str) -> Callable[[Path], None]:
    def remove(root: Path) -> None:
        git(root, "rm", "-r", name)
        git(root, "commit", "--message=Fault")

    return remove


def newer_format(root: Path) -> None:
    write(root, "docs/reference/formats.md", FORMATS.format(3))
    write(root, "tests/records/stored/3/expected.json", "{}")
    git(root, "add", ".")
    git(root, "commit", "--message=Fault")


FAULTS: list[tuple[str, Callable[[Path], None]]] = [
    ("clean tree", lambda root: write(root, "new.py", "")),
    ("branch", lambda root: git(root, "switch", "--create", "other")),
    ("tag", lambda root: git(root, "tag", "v1.2.0")),
    ("changelog heading", edited("CHANGELOG.md", "## [1.2.0] -", "## [1.2.0-1] - 2026-02-03\n\n## [1.2.0] of")),
    ("changelog entries", edited("CHANGELOG.md", "## [Unreleased]\n", "## [Unreleased]\n\n- Smaller.\n")),
    ("changelog entries", edited("CHANGELOG.md", "- Faster.\n", "")),
    ("version in the package", edited("src/livebode/version.py", "1.2.0", "1.1.0")),
    ("citation", edited("CITATION.cff", "version: 1.2.0", "version: 1.1.0")),
    ("citation", edited("CITATION.cff", "date-released: 2026-02-03\n", "")),
    ("locks", edited("pyproject.toml", "numpy>=2.0", "numpy>=2.2")),
    ("locks", edited("requirements-bench.lock", "numba==0.61\n", "")),
    ("hosts in locks", edited("package-lock.json", "{}", '{"resolved": "https://example.org/a.tgz"}')),
    ("page of commands", edited("docs/reference/command-line.md", "## livebode run", "## livebode track")),
    ("page of errors", edited("docs/reference/errors.md", "usage.missing", "usage.lacking")),
    ("page of configuration", edited("docs/reference/configuration.md", "# Configuration", "# Keys")),
    ("formats", newer_format),
    ("stored run", removed("tests/records/stored/2")),
    ("benchmark history", removed("bench/history/1.2.0.json")),
    ("benchmark history", edited("bench/history/1.2.0.json", "1.2.0", "1.1.0")),
    ("licences", edited("src/livebode/dashboard/_vendor/uplot/LICENSE", "MIT", "")),
    ("licences", edited("NOTICE", "_vendor/uplot", "")),
]  # fmt: skip


def test_a_repository_that_is_ready_misses_no_check(ready: Path) -> None:
    assert run(CHECKS, ready) == []


@pytest.mark.parametrize(("name", "fault"), FAULTS, ids=[f"{i} {name}" for i, (name, _) in enumerate(FAULTS)])
def test_a_fault_is_missed_by_its_check_alone_and_has_a_remedy(
    name: str, fault: Callable[[Path], None], ready: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = Path(shutil.copytree(ready, tmp_path / "copy"))
    fault(root)
    assert run(CHECKS, root) == [name]
    remedy = next(check.remedy for check in CHECKS if check.name == name)
    assert f"→ {remedy}\n" in capsys.readouterr().out


def test_every_check_has_a_fault_that_it_finds() -> None:
    assert {check.name for check in CHECKS} == {name for name, _ in FAULTS}


def test_a_change_of_format_that_the_changelog_mentions_is_no_fault(ready: Path, tmp_path: Path) -> None:
    root = Path(shutil.copytree(ready, tmp_path / "copy"))
    newer_format(root)
    edited("CHANGELOG.md", "- Faster.", "- Faster. Run directory, version 3.")(root)
    assert run(CHECKS, root) == []


def test_a_prepared_version_misses_only_what_it_cannot_write(ready: Path, tmp_path: Path) -> None:
    root = Path(shutil.copytree(ready, tmp_path / "copy"))
    edited("CHANGELOG.md", "## [Unreleased]\n", "## [Unreleased]\n\n- Smaller.\n")(root)
    prepare(root, "1.3.0", "2026-03-04")
    assert run(CHECKS, root) == ["clean tree", "benchmark history"]
    assert 'version = "1.3.0"' in (root / "examples/deploy/conda/meta.yaml").read_text()
    changelog = (root / "CHANGELOG.md").read_text()
    assert "## [Unreleased]\n\n## [1.3.0] - 2026-03-04\n\n- Smaller.\n\n## [1.2.0] - 2026-02-03\n" in changelog
    with pytest.raises(ValueError, match="nothing to release"):
        prepare(root, "1.4.0", "2026-03-05")


METADATA = (
    "Metadata-Version: 2.4\nName: livebode\nVersion: {version}\nSummary: Bode\nLicense-Expression: MIT\n"
    "Requires-Python: >=3.11\nDescription-Content-Type: text/markdown\n\n{text}\n"
)
LICENCES = [f"livebode-1.2.0.dist-info/licenses/{name}" for name in FILES if name.endswith(("LICENSE", "NOTICE"))]


@pytest.mark.parametrize(
    ("names", "version", "fault"),
    [
        ([*LICENCES, BUNDLE], "1.2.0", ""),
        (LICENCES, "1.2.0", f"the wheel lacks {BUNDLE}"),
        ([*LICENCES, "livebode/tests/test_run.py"], "1.2.0", "the wheel contains livebode/tests/test_run.py"),
        ([*LICENCES, "livebode/kernel/native.cpp"], "1.2.0", "the wheel contains livebode/kernel/native.cpp"),
        (LICENCES[:2], "1.2.0", "the wheel lacks the licence files src/livebode/dashboard/_vendor/uplot/LICENSE"),
        ([*LICENCES, BUNDLE], "1.1.0", "the metadata has version 1.1.0"),
    ],
)
def test_a_wheel_with_foreign_files_without_licences_bundle_or_of_another_version_is_a_fault(
    names: list[str], version: str, fault: str, ready: Path, tmp_path: Path
) -> None:
    wheel = tmp_path / "livebode.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("livebode-1.2.0.dist-info/METADATA", METADATA.format(version=version, text="Text."))
        for name in names:
            archive.writestr(name, "")
    assert wheel_fault(ready, wheel) == fault


def test_metadata_without_summary_or_description_is_a_fault() -> None:
    assert metadata_fault(METADATA.format(version="1", text="").replace("Summary: Bode\n", ""), "1") == (
        "the metadata lacks Summary"
    )
    assert metadata_fault(METADATA.format(version="1", text=""), "1") == "the metadata has no description"
