"""Checks that only read files and git: each returns what is wrong, an empty text if nothing is."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tools.command_line import page as command_page
from tools.configuration import page as configuration_page
from tools.error_codes import page as error_page
from tools.release.files import (
    citation,
    format_versions,
    git,
    newest_heading,
    project,
    section,
    text,
    version,
    version_in_package,
)

LOCKS = {f"requirements-{group}.lock": group for group in ("dev", "bench", "docs", "wheels")}
FORMATS = "docs/reference/formats.md"


@dataclass(frozen=True)
class Check:
    """What must be true for a release, how to find out, and what to do if it is not."""

    name: str
    fault: Callable[[Path], str]
    remedy: str


def tree(root: Path) -> str:
    changed = git(root, "status", "--porcelain").splitlines()
    return f"{len(changed)} files are not committed, the first is {changed[0].split()[-1]}" if changed else ""


def branch(root: Path) -> str:
    name = git(root, "branch", "--show-current")
    return "" if name == "main" else f"the branch is {name or 'detached'}, not main"


def tag(root: Path) -> str:
    name = f"v{version(root)}"
    return f"the tag {name} exists already" if git(root, "tag", "--list", name) else ""


def heading(root: Path) -> str:
    found, wanted = newest_heading(root)[0], version(root)
    return "" if found == wanted else f"pyproject.toml has {wanted}, the newest dated heading is {found or 'missing'}"


def unreleased(root: Path) -> str:
    if section(root, "Unreleased"):
        return "the Unreleased part has entries that belong to this release"
    return "" if section(root, version(root)) else f"the part of {version(root)} is empty"


def packaged(root: Path) -> str:
    found, wanted = version_in_package(root), version(root)
    return "" if found == wanted else f"pyproject.toml has {wanted}, livebode.__version__ is {found or 'missing'}"


def cited(root: Path) -> str:
    date = newest_heading(root)[1]
    wanted = {"version": version(root), "date-released": date}
    wrong = [f"{key} is {citation(root, key) or 'missing'}" for key in wanted if citation(root, key) != wanted[key]]
    return f"{', '.join(wrong)}; the release is {wanted['version']} of {date or 'no date'}" if wrong else ""


def pins(lock: str) -> dict[str, list[str]]:
    """Releases of each package in a lock; several where they depend on the Python version."""
    found: dict[str, list[str]] = {}
    for name, release in re.findall(r"^([A-Za-z0-9._-]+)(?:\[[^\]]*\])?==([^\s;\\]+)", lock, re.M):
        found.setdefault(canonicalize_name(name), []).append(release)
    return found


def required(root: Path, group: str) -> Iterator[str]:
    """The requirements that a lock has to satisfy; that of `dev` also has those of the package and its extras."""
    settings = project(root)
    yield from settings["dependency-groups"][group]
    if group == "dev":
        yield from settings["project"]["dependencies"]
        for name, extra in settings["project"].get("optional-dependencies", {}).items():
            if name != "all":  # which names the others
                yield from (one for one in extra if Requirement(one).name != settings["project"]["name"])


def locked(root: Path) -> str:
    for name, group in LOCKS.items():
        found = pins(text(root, name))
        for requirement in map(Requirement, required(root, group)):
            releases = found.get(canonicalize_name(requirement.name), [])
            if not any(requirement.specifier.contains(release, prereleases=True) for release in releases):
                return f"{name} has {requirement.name} {' '.join(releases) or 'not'}, required is {requirement}"
    return ""


def hosts(root: Path) -> str:
    named = [name for name in (*LOCKS, "package-lock.json") if "://" in text(root, name)]
    return f"{', '.join(named)} names a host" if named else ""


def generated(name: str, page: Callable[[], str]) -> Callable[[Path], str]:
    """Whether this page of the reference is what its program prints."""
    path = f"docs/reference/{name}.md"
    return lambda root: "" if text(root, path) == page() else f"{path} is not current"


def formats(root: Path) -> str:
    """Versions of formats that differ from the previous release and are not in this one's part of the changelog."""
    previous = git(root, "describe", "--tags", "--abbrev=0", "--match", "v*")
    now = format_versions(text(root, FORMATS))
    if not now:
        return f"{FORMATS} has no table of versions"
    before = format_versions(git(root, "show", f"{previous}:{FORMATS}")) if previous else {}
    changed = [name for name in before.keys() | now.keys() if previous and before.get(name) != now.get(name)]
    notes = section(root, version(root)).lower()
    silent = sorted(name for name in changed if name.lower() not in notes)
    return f"changed since {previous}, but not mentioned: {', '.join(silent)}" if silent else ""


def stored(root: Path) -> str:
    """Whether a run of the newest version is stored, of ordinary responses or of matrices."""
    newest = format_versions(text(root, FORMATS)).get("run directory", "")
    folder = root / "tests/records/stored"
    found = newest and any((folder / name / "expected.json").is_file() for name in (newest, f"matrix-{newest}"))
    return "" if found else f"there is no run of format version {newest}"


def measured(root: Path) -> str:
    name = f"bench/history/{version(root)}.json"
    found = text(root, name)
    if not found:
        return f"{name} does not exist"
    measured_version = json.loads(found)["livebode"]
    return "" if measured_version == version(root) else f"{name} was measured with {measured_version}"


def licences(root: Path) -> str:
    missing = [name for name in ("LICENSE", "NOTICE") if not text(root, name)]
    for folder in sorted(path for path in (root / "src").glob("**/_vendor/*") if path.is_dir()):
        relative = folder.relative_to(root)
        if not text(root, f"{relative}/LICENSE"):
            missing.append(f"{relative}/LICENSE")
        if str(relative) not in text(root, "NOTICE"):
            missing.append(f"{relative} in NOTICE")
    return f"missing: {', '.join(missing)}" if missing else ""


CHECKS = (
    Check("clean tree", tree, "commit or remove the changes"),
    Check("branch", branch, "git switch main"),
    Check("tag", tag, "choose the next version: python -m tools.release prepare VERSION"),
    Check("changelog heading", heading, "python -m tools.release prepare VERSION"),
    Check("changelog entries", unreleased, "move the entries to the part of this release"),
    Check("version in the package", packaged, "set __version__ in src/livebode/version.py"),
    Check("citation", cited, "set version and date-released in CITATION.cff"),
    Check("locks", locked, "make lock"),
    Check("hosts in locks", hosts, "remove the addresses from the lock"),
    Check(
        "page of commands",
        generated("command-line", command_page),
        "python -m tools.command_line > docs/reference/command-line.md",
    ),
    Check("page of errors", generated("errors", error_page), "python -m tools.error_codes > docs/reference/errors.md"),
    Check(
        "page of configuration",
        generated("configuration", configuration_page),
        "python -m tools.configuration > docs/reference/configuration.md",
    ),
    Check("formats", formats, "describe the new version of the format in CHANGELOG.md"),
    Check("stored run", stored, "python -m tests.support.stored tests/records/stored/N"),
    Check("benchmark history", measured, "python -m bench --json bench/history/VERSION.json"),
    Check("licences", licences, "add the licence file, and the component to NOTICE"),
)
