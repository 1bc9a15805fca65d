"""Every command and every snippet of the documentation runs as printed, in the directory of `livebode example`.

A page creates what it uses: a file of another page is not there for its reader. A command that several pages print
runs once. What is not run has its reason in the page, in a comment `<!-- not run: … -->` before the block. The
commands of docs/recordings.md run in a test of their own, on files of other programs; the cells of the tutorials too.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import pytest

from livebode import plugins
from tests.support.command import livebode
from tests.support.pages import PAGES, ROOT, Step, steps_of

REASONS = {
    "sets up the clone",
    "installs packages",
    "until Ctrl-C",
    "needs a machine",
    "needs another program",
    "needs root",
}
ELSEWHERE = ("docs/recordings.md", "docs/reference/command-line.md")
SHOWN = [page for page in PAGES if str(page.relative_to(ROOT)) not in ELSEWHERE and steps_of(page)]


@dataclass
class Desk:
    """The directory, and what each command has created in it."""

    folder: Path
    created: dict[str, set[Path]] = field(default_factory=dict)
    examples: set[Path] = field(default_factory=set)

    def files(self) -> set[Path]:
        return {path.relative_to(self.folder) for path in self.folder.rglob("*")}


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    folder = tmp_path_factory.mktemp("desk")
    matplotlib.use("Agg")
    assert livebode("example", "all", "--out", folder / "example").code == 0
    desk = Desk(folder / "example")
    desk.examples = desk.files()
    yield desk
    plt.close("all")


def run(step: Step, desk: Desk, names: dict[str, Any]) -> set[Path]:
    """Run it, unless another page has run the same command, and give the files that it creates."""
    if step.text in desk.created:
        return desk.created[step.text]
    before = desk.files()
    if step.python:
        exec(compile(step.text, "snippet", "exec", dont_inherit=True), names)
    else:
        program, *words = step.words
        assert program == "livebode", f"{step.text}: mark what is not run with its reason"
        result = livebode(*words)
        assert result.code == step.code, f"livebode {' '.join(words)}\n{result.err}"
    created = desk.files() - before
    if not step.python:
        desk.created[step.text] = created
    return created


def named(step: Step, folder: Path) -> set[Path]:
    """The files of the directory that it names."""
    words = re.findall(r"""["']([^"'\n]+)["']""", step.text) if step.python else step.words
    return {Path(word) for word in words if len(word) < 100 and "\n" not in word and (folder / word).exists()} - {
        Path()
    }


@pytest.mark.parametrize("page", SHOWN, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_a_page_shows_runs_with_files_of_the_examples_and_its_own(
    page: Path, desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(desk.folder)
    own, names = set(desk.examples), {"__name__": "page"}
    for step in steps_of(page):
        if step.reason or step.text in ("livebode example all", "cd example"):
            continue
        own |= run(step, desk, names)
        missing = {path for path in named(step, desk.folder) if path not in own}
        assert not missing, f"{step.text}\nuses {missing}, which neither an example nor this page creates"


def test_what_is_not_run_has_one_of_few_reasons() -> None:
    reasons = {step.reason for page in PAGES for step in steps_of(page) if step.reason}
    assert reasons <= REASONS, reasons - REASONS
    unrun = [step.text for page in PAGES for step in steps_of(page) if step.reason and step.python]
    assert len(unrun) <= 2, "snippets of Python run, except a model of another program and a live source"


def test_the_commands_that_an_example_prints_are_on_a_page_or_run(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(desk.folder)
    for example in plugins.named("examples").values():
        for command in example.commands:
            run(Step(command), desk, {})
