"""`make size`: lines, files and imports of each package beside its limits, and the figures of the whole.

The limits are in `tests/meta/size_limits.toml`; `python -m tools.size --limits` prints them as they are now. Lines are
all lines of `*.py` files and of the stubs of faces. An import is one from a package to another; it goes past a face
where it names a module inside the other package, such as `livebode.core.lines` instead of `livebode.core`. Each wing
counts as one package; `livebode.sources.live` is a face of its own. `livebode.dataclass` takes the place of a module of
the standard library and does not count.
"""

from __future__ import annotations

import sys
import tomllib
from collections import Counter
from dataclasses import asdict, dataclass
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import grimp
import typer

from livebode.cli.app import app
from tools.recording_path import RunTrace, traced_run

ROOT = Path(__file__).parents[1]
LIMITS = ROOT / "tests/meta/size_limits.toml"


@dataclass(frozen=True)
class Size:
    """Lines, files and imports from other packages of one package."""

    lines: int
    files: int
    imports: int


def roots() -> dict[str, Path]:
    """Directory of the hull's package and of each wing's, by name; the hull is the first."""
    wings = sorted(path.parent for path in ROOT.glob("wings/*/src/*/__init__.py"))
    return {path.name: path for path in [ROOT / "src/livebode", *wings]}


def package(module: str) -> str:
    """`livebode.core` of `livebode.core.lines`; a wing is one package."""
    words = module.split(".")
    return ".".join(words[:2]) if words[0] == "livebode" else words[0]


@cache
def graph() -> Any:
    """Import graph of hull and wings."""
    sys.path[:0] = [str(path.parent) for path in roots().values()]
    return grimp.build_graph(*roots())


@cache
def imports() -> tuple[tuple[str, str], ...]:
    """Module and imported module of each import from one package to another."""
    return tuple(
        (module, other)
        for module in sorted(graph().modules)
        for other in sorted(graph().find_modules_directly_imported_by(module))
        if package(module) != package(other) and other != "livebode.dataclass"
    )


def past_faces() -> list[tuple[str, str]]:
    """Imports that go past the face of the imported package."""
    return [(module, other) for module, other in imports() if other not in (package(other), "livebode.sources.live")]


def single_importers() -> list[str]:
    """Modules that only one other module imports, of their own package, and no face or table names."""
    named = {line.split()[1] for root in roots().values() for stub in root.rglob("*.pyi") for line in _imports_in(stub)}
    text = "\n".join(path.read_text(encoding="utf-8") for root in roots().values() for path in root.rglob("*.py"))
    importers = {module: graph().find_modules_that_directly_import(module) for module in sorted(graph().modules)}
    alone = {module: next(iter(others)) for module, others in importers.items() if len(others) == 1}
    own = [module for module, other in alone.items() if package(module) == package(other)]
    return [module for module in own if module not in named and f"{module}:" not in text]


def _imports_in(stub: Path) -> list[str]:
    return [line for line in stub.read_text(encoding="utf-8").splitlines() if line.startswith("from ")]


def import_depth() -> int:
    """Modules of the longest chain of imports; those of a circle count once."""
    above = {module: graph().find_upstream_modules(module) for module in graph().modules}
    circle = {module: min([module, *(other for other in above[module] if module in above[other])]) for module in above}
    below: dict[str, set[str]] = {name: set() for name in circle.values()}
    for module, name in circle.items():
        below[name] |= {circle[other] for other in graph().find_modules_directly_imported_by(module)} - {name}
    depth: dict[str, int] = {}
    for name in TopologicalSorter(below).static_order():
        depth[name] = 1 + max((depth[other] for other in below[name]), default=0)
    return max(depth.values())


def sizes() -> dict[str, Size]:
    """Size of each package of the hull (`livebode` has its single modules), then of each wing."""
    across = Counter(package(module) for module, _ in imports())
    files: dict[str, list[Path]] = {}
    for name, root in roots().items():
        for path in (*root.rglob("*.py"), *root.rglob("*.pyi")):
            module = ".".join([name, *path.relative_to(root).with_suffix("").parts])
            single = name == "livebode" and path.parent == root
            files.setdefault(name if single else package(module), []).append(path)
    return {
        name: Size(
            sum(path.read_text(encoding="utf-8").count("\n") for path in paths),
            sum(path.suffix == ".py" for path in paths),
            across[name],
        )
        for name, paths in sorted(files.items())
    }


def limits() -> dict[str, dict[str, int]]:
    """Limits of each package by name."""
    return tomllib.loads(LIMITS.read_text(encoding="utf-8"))


def limits_text(measured: dict[str, Size]) -> str:
    """Limits with little room: lines up to the next 50, imports up to the next 5."""
    rows = []
    for name, size in measured.items():
        lines, others = -(-size.lines // 50) * 50, -(-size.imports // 5) * 5
        rows.append(f'["{name}"]\nlines = {lines}\nfiles = {size.files}\nimports = {others}\n')
    return "\n".join(rows)


def commands_and_options() -> tuple[int, int]:
    """Number of commands (of a group, each of its own) and of their options."""
    groups = typer.main.get_command(app).commands.values()  # type: ignore[attr-defined]
    every = [inner for group in groups for inner in getattr(group, "commands", {"": group}).values()]
    return len(every), sum(parameter.param_type_name == "option" for command in every for parameter in command.params)


def figures(measured: dict[str, Size], trace: RunTrace) -> dict[str, str]:
    """Figures of the whole."""
    hull = [size for name, size in measured.items() if package(name).startswith("livebode.") or name == "livebode"]
    commands, options = commands_and_options()
    return {
        "hull: lines / files / packages": f"{sum(size.lines for size in hull):,} / "
        f"{sum(size.files for size in hull):,} / {len(hull) - 1}",
        "hull and wings: lines": f"{sum(size.lines for size in measured.values()):,}",
        "import depth": f"{import_depth()}",
        "modules with a single importer, of their own package": f"{len(single_importers())}",
        "imports past a face": f"{len(past_faces())} of {len(imports())} ({len(past_faces()) / len(imports()):.0%})",
        "commands / options": f"{commands} / {options}",
        "README: lines": f"{(ROOT / 'README.md').read_text(encoding='utf-8').count(chr(10))}",
        "livebode modules that `run` of a CSV loads": f"{trace.modules}",
        "files that the name of its recording passes through": f"{len(set(trace.files))}, "
        f"upwards {trace.upwards()} times",
    }


def main() -> None:
    """Print both tables, or the limits."""
    measured = sizes()
    if sys.argv[1:] == ["--limits"]:
        print(limits_text(measured), end="")
        return
    bound = limits()
    print(f"{'package':32}{'lines':>16}{'files':>12}{'imports':>14}   (limit)")
    for name, size in sorted(measured.items(), key=lambda item: -item[1].lines):
        cells = [f"{value:,} ({bound.get(name, {}).get(key, 0):,})" for key, value in asdict(size).items()]
        print(f"{name:32}{cells[0]:>16}{cells[1]:>12}{cells[2]:>14}")
    print()
    for name, value in figures(measured, traced_run()).items():
        print(f"{name:56}{value}")


if __name__ == "__main__":
    main()
