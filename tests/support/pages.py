"""The commands and snippets of the documentation, in the order of each page."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md")), *sorted(ROOT.glob("wings/**/*.md"))]
_STEP = re.compile(
    r"(?:^<!-- not run: (?P<reason>[^\n]*?) -->\n\n?)?"
    r"(?:^```(?P<language>[^\n]*)\n(?P<code>.*?)^```$|(?P<shell>(?:^    [^\n]+\n)+))",
    re.M | re.S,
)
_PROGRAMS = ("livebode", "cd", "make", "pip", "python", "$")


@dataclass(frozen=True)
class Step:
    """A command, or a snippet of Python; `reason`: why no test runs it, as the page states in a comment.

    `code` is its exit code: 2 if the page shows an error below it.
    """

    text: str
    python: bool = False
    reason: str = ""
    code: int = 0

    @property
    def words(self) -> list[str]:
        """The words of a command, without its comment."""
        return shlex.split(self.text, comments=True)


def steps_of(page: Path) -> list[Step]:
    """What a reader of the page would run, in order."""
    return list(_steps(page.read_text("utf-8")))


def _steps(text: str) -> Iterator[Step]:
    for found in _STEP.finditer(text):
        reason = found["reason"] or ""
        if found["language"] == "python":
            yield Step(found["code"], python=True, reason=reason)
            continue
        if found["language"] not in (None, "console"):
            continue
        shown = found["code"] or re.sub(r"^    ", "", found["shell"], flags=re.M)
        if not found["code"] and not shown.startswith(_PROGRAMS):
            continue  # an indented list
        prompted = shown.startswith("$")
        for line in shown.replace("\\\n", " ").splitlines():
            if line.startswith("$ ") or not (prompted or line.lstrip().startswith("#")):  # else output, or a comment
                refused = prompted and bool(re.search(r"^(livebode: |\{\"error\")", shown, re.M))
                yield Step(" ".join(line.removeprefix("$ ").split()), reason=reason, code=2 * refused)
