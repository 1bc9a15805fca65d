"""Checks of the installation: extras, plug-ins, instruction set."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, metadata, requires, version
from typing import TYPE_CHECKING

from livebode.core import install_command, packages_of
from livebode.doctor.check import Check
from livebode.kernel import instruction_set, instruction_sets
from livebode.plugins import GROUPS, plugins

if TYPE_CHECKING:
    from packaging.requirements import Requirement


EXTRAS = "extras"
_ALL = "all"  # the extra of all others


def check_extras() -> Check:
    """The extras of the installed livebode, by its own metadata."""
    problems: dict[str, list[str]] = {
        extra: [] for extra in metadata("livebode").get_all("Provides-Extra") or () if extra != _ALL
    }
    required = requires("livebode") or []
    installed = cache(_version)  # several extras need the same package, and its metadata is a file
    for extra in problems:
        needed = packages_of(extra, required)
        problems[extra] = [
            problem for requirement in needed if (problem := _problem(requirement, installed(requirement.name)))
        ]
    return judged_extras(problems)


def judged_extras(problems: dict[str, list[str]]) -> Check:
    """The check of what is wrong with each extra; "EXTRAS is missing" where a package is not installed."""
    present = [extra for extra, wrong in problems.items() if not wrong]
    missing = [extra for extra, wrong in problems.items() if any(text.endswith(" is missing") for text in wrong)]
    old = [extra for extra in problems if extra not in present and extra not in missing]
    facts = {"present": present, "missing": missing, "unsuitable": old}
    parts = [f"{_listed(present) or 'none'} installed"]
    if missing:
        parts.append(f"{_listed(missing)} not installed")
    if old:
        parts.append("; ".join(text for extra in old for text in problems[extra]))
        return Check(EXTRAS, "warning", "; ".join(parts), f"run {install_command(*old)}", facts)
    remedy = f"for what is missing and needed run {install_command(*missing)}" if missing else ""
    return Check(EXTRAS, "ok", "; ".join(parts), remedy, facts)


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _problem(requirement: Requirement, version: str | None) -> str:
    if version is None:
        return f"{requirement.name} is missing"
    if requirement.specifier.contains(version, prereleases=True):
        return ""
    return f"{requirement.name} {version} is installed, {requirement.specifier} is required"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)


PLUGINS = "plug-ins"


def check_plugins() -> Check:
    """The tables of other packages; each is loaded, but not the parts that it names.

    livebode's own are loaded, for the names in them, where another package adds to their group.
    """
    groups_of: dict[str, list[str]] = {}
    problems: list[str] = []
    for group in GROUPS:
        known: set[str] = set()
        declared = plugins(group)
        if all(plugin.is_own for plugin in declared):
            continue
        for plugin in declared:
            if not plugin.is_own:
                groups_of.setdefault(f"{plugin.package} {plugin.version}", []).append(group)
            try:
                table = plugin.table()
            except (ImportError, TypeError) as error:
                problems.append(str(error))
                continue
            names = {*table} if isinstance(table, Mapping) else set()
            problems += [
                f"{name!r} in the {group} of {plugin.package} is not used, because an earlier table has this name"
                for name in sorted(known & names)
            ]
            known |= names
    listed = "; ".join(f"{package} ({', '.join(groups)})" for package, groups in groups_of.items())
    facts = {"packages": groups_of, "problems": problems}
    if problems:
        return Check(PLUGINS, "warning", "; ".join([listed, *problems]), "update these plug-ins, or remove them", facts)
    return Check(PLUGINS, "ok", listed or "none is installed", facts=facts)


INSTRUCTION_SET = "instruction set"


def check_instruction_set() -> Check:
    """The one that is used, of those that this machine has."""
    available = list(instruction_sets())
    facts = {"available": available, "machine": platform.machine()}
    try:
        used = instruction_set()
    except ValueError as error:
        return Check(INSTRUCTION_SET, "failed", str(error), f"unset it, or take one of {', '.join(available)}", facts)
    message = f"the kernel uses {used}; this {platform.machine()} computer has {', '.join(available)}"
    if used != available[-1]:
        remedy = "unset LIVEBODE_INSTRUCTION_SET; the results are the same, and faster"
        return Check(INSTRUCTION_SET, "warning", message, remedy, facts | {"used": used})
    return Check(INSTRUCTION_SET, "ok", message, facts=facts | {"used": used})
