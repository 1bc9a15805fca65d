"""Plug-ins: tables of parts that livebode and other installed packages declare (docs/how-to/plugin.md).

A package that adds to livebode names a table for each group that it adds to::

    [project.entry-points."livebode.sinks"]
    example = "livebode_example.tables:SINKS"

The module of a table is loaded when the first part of its group is needed; a table names the modules of its parts as
"module:name", and each is loaded when it is used. livebode's own tables are declared and read in the same way.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

GROUPS: Mapping[str, type[Mapping[str, Any]] | type[Sequence[Any]]] = {
    "readers": Sequence,  # in the order in which their formats are tried
    "sources": Mapping,
    "sinks": Mapping,
    "commands": Mapping,
    "exports": Mapping,
    "models": Mapping,
    "analyses": Mapping,
    "estimates": Mapping,
    "documents": Mapping,
    "examples": Mapping,
    "files": Mapping,
    "pages": Mapping,
    "workspaces": Mapping,
}
"""The groups, and the type of their tables; a mapping has the name of each part."""
_OWN = "livebode"
_PREFIX, _ENDING = "[livebode.", ".dist-info"


class PluginWarning(UserWarning):
    """A plug-in that cannot be loaded; everything else works without it."""


class Plugin(NamedTuple):  # dataclasses would double what `livebode --help` adds to the start of Python
    """The table that a package declares for a group, as "module:name"."""

    group: str
    package: str
    version: str
    reference: str

    @property
    def is_own(self) -> bool:
        """Whether it is livebode's."""
        return self.package == _OWN

    @property
    def root(self) -> str:
        """The package of Python that has it."""
        return self.reference.partition(":")[0].partition(".")[0]

    @property
    def is_present(self) -> bool:
        """Whether it was installed: livebode can be installed without a wing."""
        if not self.is_own or self.root == _OWN:
            return True
        from importlib.util import find_spec

        return find_spec(self.root) is not None

    def table(self) -> Any:
        """The table. ImportError or TypeError, in one sentence, if it cannot be loaded."""
        try:
            table = loaded(self.reference)
        except Exception as error:  # whatever the module of somebody else does
            raise ImportError(self._problem(not_loaded(error))) from error
        if not isinstance(table, GROUPS[self.group]):
            expected = GROUPS[self.group].__name__.lower()
            raise TypeError(self._problem(f"is of type {type(table).__name__}, not a {expected}"))
        return table

    def _problem(self, what: str) -> str:
        return (
            f"the {self.group} of the plug-in {self.package} {self.version}: {self.reference} {what}; "
            f"update the plug-in, or remove it: pip uninstall {self.package}"
        )


def plugins(group: str) -> list[Plugin]:
    """The declared tables of a group, livebode's own first, then by the name of the package; none is loaded."""
    found = [plugin for plugin in _declared() if plugin.group == group and plugin.is_present]
    return sorted(found, key=lambda plugin: (not plugin.is_own, plugin.package))


@cache
def _declared() -> tuple[Plugin, ...]:
    """The tables of all packages; of two packages with one name, those of the first one on the path.

    importlib.metadata finds the same, but takes three times as long to import as Python to start.
    """
    found: dict[str, tuple[Plugin, ...]] = {}
    for folder in sys.path:
        for name in _names_in(folder or "."):
            if name.endswith(_ENDING) and (text := _entry_points(os.path.join(folder, name))):
                package, _, version = name.removesuffix(_ENDING).rpartition("-")
                package = package.replace("_", "-").lower()
                tables_of = (Plugin(group, package, version, reference) for group, reference in _parsed(text))
                found.setdefault(package, tuple(tables_of))
    return tuple(plugin for package in found.values() for plugin in package)


def _names_in(folder: str) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:  # an archive, or a directory that is missing or may not be read
        return []


def _entry_points(folder: str) -> str:
    """The entry points of a package, if some are for livebode."""
    try:
        with open(f"{folder}/entry_points.txt", encoding="utf-8") as file:
            text = file.read()
    except (OSError, UnicodeError):  # it has none, or is just being removed
        return ""
    return text if _PREFIX in text else ""


def _parsed(text: str) -> Iterator[tuple[str, str]]:
    """Group and reference of each table in an entry_points.txt."""
    group = ""
    for line in map(str.strip, text.splitlines()):
        if line.startswith("["):
            group = line.removeprefix(_PREFIX).rstrip("]") if line.startswith(_PREFIX) else ""
        elif group and "=" in line and not line.startswith(("#", ";")):
            yield group, line.partition("=")[2].strip()


def wings_left_out(group: str) -> list[str]:
    """The wings of livebode with a table of this group that were not installed."""
    return [
        plugin.root.removeprefix(f"{_OWN}_")
        for plugin in _declared()
        if plugin.group == group and not plugin.is_present
    ]


@cache
def tables(group: str) -> tuple[Any, ...]:
    """The tables of a group in the order of `plugins`; one that cannot be loaded is left out with a PluginWarning."""
    return tuple(_loaded(plugins(group)))


def _loaded(declared: Sequence[Plugin]) -> Iterator[Any]:
    for plugin in declared:
        try:
            yield plugin.table()
        except (ImportError, TypeError) as error:
            warnings.warn(str(error), PluginWarning, stacklevel=3)


@cache
def named(group: str) -> Mapping[str, Any]:
    """The parts of a group by name; of two with one name, the first in the order of `plugins`.

    >>> list(named("models"))[:2]
    ['rigid', 'two-mass']
    """
    parts: dict[str, Any] = {}
    for table in tables(group):
        parts = parts | {name: part for name, part in table.items() if name not in parts}
    return parts


def not_loaded(error: Exception) -> str:
    """What to say of a reference that raised this error, whatever the module of somebody else does.

    >>> not_loaded(OSError("no licence"))
    'cannot be loaded (OSError: no licence)'
    """
    reason = " ".join(str(error).split()) or "no reason given"
    return f"cannot be loaded ({type(error).__name__}: {reason})"


def loaded(reference: str) -> Any:
    """What a table names as "module:name".

    >>> loaded("livebode.version:__version__").count(".")
    2
    """
    module, _, name = reference.partition(":")
    return getattr(import_module(module), name)
