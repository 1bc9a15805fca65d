"""Which optional packages are installed, and whether their versions suffice."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, metadata, requires, version
from typing import TYPE_CHECKING

from livebode.core import install_command, packages_of
from livebode.doctor.check import Check

if TYPE_CHECKING:
    from packaging.requirements import Requirement

NAME = "extras"
_ALL = "all"  # the extra of all others


def check_extras() -> Check:
    """The extras of the installed livebode, by its own metadata."""
    found: dict[str, list[str]] = {
        extra: [] for extra in metadata("livebode").get_all("Provides-Extra") or () if extra != _ALL
    }
    required = requires("livebode") or []
    installed = cache(_version)  # several extras need the same package, and its metadata is a file
    for extra in found:
        needed = packages_of(extra, required)
        found[extra] = [problem for one in needed if (problem := _problem(one, installed(one.name)))]
    return judged(found)


def judged(problems: dict[str, list[str]]) -> Check:
    """The check of what is wrong with each extra; "NAME is missing" where a package is not installed."""
    present = [extra for extra, wrong in problems.items() if not wrong]
    missing = [extra for extra, wrong in problems.items() if any(text.endswith(" is missing") for text in wrong)]
    old = [extra for extra in problems if extra not in present and extra not in missing]
    facts = {"present": present, "missing": missing, "unsuitable": old}
    parts = [f"{_listed(present) or 'none'} installed"]
    if missing:
        parts.append(f"{_listed(missing)} not installed")
    if old:
        parts.append("; ".join(text for extra in old for text in problems[extra]))
        return Check(NAME, "warning", "; ".join(parts), f"run {install_command(*old)}", facts)
    remedy = f"for what is missing and needed run {install_command(*missing)}" if missing else ""
    return Check(NAME, "ok", "; ".join(parts), remedy, facts)


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _problem(requirement: Requirement, found: str | None) -> str:
    if found is None:
        return f"{requirement.name} is missing"
    if requirement.specifier.contains(found, prereleases=True):
        return ""
    return f"{requirement.name} {found} is installed, {requirement.specifier} is required"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)
