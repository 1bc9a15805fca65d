"""Which plug-ins are installed, what each adds, and which cannot be used."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.doctor.check import Check
from livebode.plugins import GROUPS, plugins

NAME = "plug-ins"


def check_plugins() -> Check:
    """The tables of other packages; each is loaded, but not the parts that it names."""
    groups_of: dict[str, list[str]] = {}
    problems: list[str] = []
    for group in GROUPS:
        known: set[str] = set()
        for plugin in plugins(group):
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
        return Check(NAME, "warning", "; ".join([listed, *problems]), "update these plug-ins, or remove them", facts)
    return Check(NAME, "ok", listed or "none is installed", facts=facts)
