"""`make test-changed BASE=COMMIT`: run the tests that what changed since a commit can concern; `make test` runs all.

A test is concerned if it, or what it imports directly or not, has changed, or a module of the package whose tests it is
among. A name of a face leads to the module that has it; names of modules and commands in strings count as imports. What
is no module (a script, C, a table) stands for the modules of the nearest directory above it; a page for tests/meta.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from livebode.plugins import named, plugins

ROOT = Path(__file__).parents[1]
_TOP = ("src", "tests", "tools", "studies", "bench", "wings")
_TABLES_OF_COMMANDS = {plugin.reference.split(":")[0] for plugin in plugins("commands")}
# Texts are searched: the trees of 1,800 modules take ten seconds.
_FROM = re.compile(r"^\s*from (?P<module>[\w.]+) import (?:\((?P<many>[^)]*)\)|(?P<few>[^\n(]+))", re.MULTILINE)
_IMPORT = re.compile(r"^\s*import ([\w., ]+)", re.MULTILINE)
_COMMENT = re.compile(r"#.*")
_STRING = re.compile(r"[\"']([\w-]+)[\"']")
_NAMED = re.compile(r"[\"'](livebode\w*(?:\.\w+)+)(?::\w+)?[\"']")


@cache
def modules() -> dict[str, Path]:
    """File of each module by its name; a test of a wing has the name `wings.connect.tests.test_x`."""
    found = {}
    for path in (path for top in _TOP for path in (ROOT / top).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        parts = parts[parts.index("src") + 1 :] if "src" in parts else parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def _text(name: str) -> str:
    path, stub = modules()[name], modules()[name].with_suffix(".pyi")  # a face has its names in a stub
    return (stub if stub.exists() else path).read_text(encoding="utf-8")


@cache
def _imported(name: str) -> tuple[tuple[str, str], ...]:
    """Module and attribute of each `from module import attribute`, also of those in the text of a script."""
    return tuple(
        (found["module"], alias.split()[0])
        for found in _FROM.finditer(_text(name))
        for alias in _COMMENT.sub("", found["few"] or found["many"]).split(",")
        if alias.strip()
    )


@cache
def _homes(name: str) -> dict[str, str]:
    """Module that each imported attribute of a module is from."""
    return {attribute: module for module, attribute in reversed(_imported(name))}


def _home(name: str, attribute: str) -> str:
    """The module that a name of a module, or of a package's face, comes from."""
    if f"{name}.{attribute}" in modules():
        return f"{name}.{attribute}"
    origin = _homes(name).get(attribute, name) if name in modules() else name
    return name if origin == name else _home(origin, attribute)


@cache
def imports(name: str) -> frozenset[str]:
    """Modules that a module names."""
    return frozenset(found for found in _imports(name) if found in modules()) - {name}


def _imports(name: str) -> Iterator[str]:
    if modules()[name].name != "__init__.py":
        yield from (_home(module, attribute) for module, attribute in _imported(name))
    for names in _IMPORT.findall(_text(name)):
        yield from (alias.split()[0] for alias in names.split(","))
    if name not in _TABLES_OF_COMMANDS:  # else whatever runs a command in this process would depend on all commands
        yield from _NAMED.findall(_text(name))
        if "tests" in name.split("."):
            yield from _of_commands(name)


def _of_commands(name: str) -> Iterator[str]:
    """Modules of the commands whose names are strings of a test."""
    for text in set(_STRING.findall(_text(name))) & named("commands").keys():
        command = named("commands")[text]
        yield from (
            one.function.split(":")[0] for one in ([command] if command.function else command.commands.values())
        )


@cache
def _importers() -> dict[str, set[str]]:
    """Modules that name a module, or are a test of its package, by the module's name."""
    importers: dict[str, set[str]] = {}
    for name in modules():
        own = tested(name)
        for other in imports(name) | {other for other in modules() if own and (other + ".").startswith(own)}:
            importers.setdefault(other, set()).add(name)
    return importers


def concerned(changed: Iterable[str]) -> set[str]:
    """Modules that have changed, or import one of those directly or not."""
    found: set[str] = set()
    left = list(changed)
    while left:
        if (name := left.pop()) not in found:
            found.add(name)
            left += _importers().get(name, ())
    return found


def tested(name: str) -> str | None:
    """Beginning of the names of the package's modules whose tests this module is among."""
    words = name.split(".")
    if words[0] == "wings" and words[2] == "tests":
        return f"livebode_{words[1]}."
    return f"livebode.{words[1]}." if words[0] == "tests" and len(words) > 2 else None


def changed_modules(path: Path) -> set[str]:
    """Modules that a changed file is or stands for."""
    if path.suffix == ".md":
        return {name for name in modules() if name.startswith("tests.meta.")}
    if path in modules().values():
        return {name for name, one in modules().items() if one == path}
    near = next(folder for folder in path.parents if folder == ROOT or any(folder.glob("*.py")))
    return {name for name, one in modules().items() if one.is_relative_to(near)}


def main() -> int:
    """Run the tests that concern the files that differ from a commit's."""
    command = ["git", "diff", "--name-only", "--no-renames", sys.argv[1]]
    lines = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    found = concerned({name for line in lines for name in changed_modules(ROOT / line)})
    tests = sorted(str(modules()[name]) for name in found if name.split(".")[-1].startswith("test_"))
    print(f"{len(lines)} files changed since {sys.argv[1]}: {len(tests)} files of tests")
    return (
        subprocess.run([sys.executable, "-m", "pytest", *sys.argv[2:], *tests], cwd=ROOT, check=False).returncode
        if tests
        else 0
    )


if __name__ == "__main__":
    sys.exit(main())
