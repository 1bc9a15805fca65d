"""The pages: links, commands, files, modules and loggers that they name exist, and their lines are short."""

from __future__ import annotations

import re
import tomllib
from fnmatch import fnmatch
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import pytest
import typer

from livebode.analysis import ALARMS
from livebode.cli.app import app
from livebode.plugins import GROUPS

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "SECURITY", "STYLE")] + [
    *ROOT.glob("docs/**/*.md"),
    *ROOT.glob("wings/**/*.md"),
]
CHANGELOG = ROOT / "CHANGELOG.md"
COLUMNS = 125
FORMER = {f"livebode.{name}" for name in ("experiment_design", "experiments", "output_only", "export.to_xarray")}
"""Names whose successors CHANGELOG.md gives."""


def prose(page: Path) -> str:
    """The page without its blocks of code."""
    return re.sub(r"^(```+).*?^\1$", "", page.read_text("utf-8"), flags=re.M | re.S)


def anchors(page: Path) -> set[str]:
    """The names of the headings in links, as GitHub and MyST form them."""
    headings = re.findall(r"^#+ +(.+?) *$", prose(page), re.M)
    plain = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower() for heading in headings]
    return {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_to_a_page_and_a_heading(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        path, _, anchor = target.partition("#")
        if "://" in path:
            continue
        there = page.parent / path if path else page
        assert there.exists(), target
        assert not anchor or anchor in anchors(there), target


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_no_line_but_of_a_table_or_a_picture_is_longer_than_the_style_allows(page: Path) -> None:
    """A row of a table and the description of a picture cannot be broken."""
    lines = enumerate(page.read_text("utf-8").splitlines(), 1)
    assert not [n for n, line in lines if len(line) > COLUMNS and not line.startswith(("|", "!["))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_is_on_no_index_is_installed_from_the_clone(page: Path) -> None:
    """Only the page of the installation names an index, and says that no release is there yet."""
    if page.name != "install.md":
        assert not re.findall(r"pipx? install[^`#\n]*(?<![\w/])livebode\b", page.read_text("utf-8"))


def spans(page: Path) -> list[str]:
    """The code in the sentences of a page, each on one line, but for the names of file formats (`livebode run`)."""
    text = re.sub(r"^.*`format`.*$", "", prose(page), flags=re.M)
    paragraphs = re.split(r"\n\s*\n", text)
    return [" ".join(span.split()) for part in paragraphs for span in re.findall(r"`([^`]+)`", part)]


COMMANDS: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
INNER = {name: set(getattr(command, "commands", ())) for name, command in COMMANDS.items()}
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]


@pytest.mark.parametrize("page", [*PAGES, CHANGELOG], ids=lambda page: str(page.relative_to(ROOT)))
def test_a_command_in_a_sentence_exists(page: Path) -> None:
    """`livebode fit`, `fleet run`, and `fit` in a list of commands."""
    for span in spans(page):
        program, name, inner = re.findall(r"^(livebode |)([a-z-]*)(?: ([a-z-]+)(?![^ ]))?", span)[0]
        assert not program or not name or name.startswith("-") or name in COMMANDS, span
        assert not inner or not INNER.get(name) or inner in INNER[name], span
    for series in re.findall(r"`[a-z-]+`(?:(?:,| and| or)\s+`[a-z-]+`)+", prose(page)):
        names = set(re.findall("[a-z-]+(?=`)", series))
        commands = names & COMMANDS.keys() - EXTRAS.keys()
        assert len(commands) < 2 or names <= COMMANDS.keys() | set().union(*INNER.values()), series


@pytest.mark.parametrize("page", [*PAGES, CHANGELOG], ids=lambda page: str(page.relative_to(ROOT)))
def test_a_file_and_a_module_that_a_page_names_exist(page: Path) -> None:
    files = r"(?<![\w/.-])(?:docs|examples|kernel|native|src|studies|tests|tools|wings)/[\w./-]*\.(?:py|md|c|h)\b"
    for name in re.findall(files, page.read_text("utf-8")):
        assert (ROOT / name).exists() or (page.parent / name).exists(), name
    tables = {f"livebode.{group}" for group in GROUPS}
    for span in spans(page):
        for name in set(re.findall(r"^livebode(?:_[a-z]+)?(?:\.\w+)+(?=$|\()", span)) - tables - FORMER:
            assert resolve_name(name) is not None


def test_the_page_of_the_doctor_lists_the_loggers() -> None:
    """A live source logs below `sources.live`, whatever package it is of."""
    page = (ROOT / "docs" / "how-to" / "doctor.md").read_text("utf-8")
    listed = set()
    for row in re.findall(r"^\| (`[a-z_.*`, ]+) \|", page.partition("| logger below")[2], re.M):
        first, *others = re.findall("`([^`]+)`", row)
        below = first.rpartition(".")[0]
        listed |= {first} | {below + other if other.startswith(".") else other for other in others}
    package = ROOT / "src" / "livebode"
    modules = {path: ".".join(path.relative_to(package).with_suffix("").parts) for path in package.rglob("*.py")}
    logging = {name for path, name in modules.items() if "getLogger(__name__)" in path.read_text("utf-8")}
    sources = {f"sources.live.{path.stem}" for path in ROOT.glob("wings/*/src/*/live/*.py")}
    assert [name for name in listed if not any(fnmatch(one, name) for one in {*modules.values(), *sources})] == []
    assert [one for one in logging if not any(fnmatch(one, name) for name in listed)] == []


def test_the_layers_on_the_page_are_those_that_the_imports_are_checked_with() -> None:
    page = (ROOT / "docs" / "explanation" / "architecture.md").read_text("utf-8")
    rows = re.findall(r"^\| (\d+) \| ((?:`\w+`(?:, )?)+) \|", page, re.M)
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    layers = [set(layer.split(" | ")) for layer in contracts[0]["layers"]]
    assert [set(re.findall(r"\w+", packages)) for _, packages in rows] == layers
    assert [int(number) for number, _ in rows] == list(reversed(range(len(layers))))


def test_the_page_of_runs_names_the_alarms_that_a_trend_counts() -> None:
    page = (ROOT / "docs" / "how-to" / "runs.md").read_text("utf-8")
    sentence = page.partition("- **Alarms**")[2].partition("\n- ")[0]
    assert re.findall("`([a-z-]+)`", sentence) == list(ALARMS)
