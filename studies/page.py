"""Writes docs/explanation/studies.md from the numbers of the studies: no number on that page is typed by hand."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from studies.result import Study

HEAD = """# The studies: the paper's experiments, measured

`make studies` writes this page; `python -m studies NAME` runs one study. Figures and numbers (JSON) are in
`docs/images/studies/`. The axis is that of [the simulated axis](../reference/axis.md), the estimates are those of
[estimators](estimators.md), and the paper is Nevaranta et al. 2016, whose equations are cited as (1) … (28).
Each target is marked **met** or **missed**; a missed target has a reason.
"""


def write_page(studies: Sequence[Study], folder: Path, page: Path) -> None:
    """The page of all studies that have numbers in `folder`."""
    measured = [study for study in studies if (folder / f"{study.name}.json").exists()]
    parts = [_section(study, json.loads((folder / f"{study.name}.json").read_text("utf-8"))) for study in measured]
    page.write_text("\n".join([HEAD, *parts]), encoding="utf-8")


def _section(study: Study, numbers: dict[str, Any]) -> str:
    figure = f"![{study.title}](../images/studies/{study.name}.png)"
    verdicts = [_wrapped(f"- {_verdict(v)}", "  ") for v in numbers["verdicts"]]
    tables = [_table(t) for t in numbers["tables"]]
    paper = _wrapped(f"**The paper:** {study.paper}")
    return "\n".join([f"## {study.title}\n", figure + "\n", paper + "\n", *verdicts, "", *tables])


def _wrapped(text: str, indent: str = "") -> str:
    """Lines of at most 120 columns."""
    return textwrap.fill(text, 120, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def _verdict(verdict: dict[str, Any]) -> str:
    word, sentence = verdict["verdict"], verdict["sentence"]
    return f"**{word}** {sentence.removeprefix(word).strip()}"


def _table(table: dict[str, Any]) -> str:
    head = "| " + " | ".join(table["header"]) + " |"
    rule = "|" + "---|" * len(table["header"])
    rows = ["| " + " | ".join(_cell(cell) for cell in row) + " |" for row in table["rows"]]
    return "\n".join([_wrapped(table["caption"] + ":") + "\n", head, rule, *rows, ""])


def _cell(cell: Any) -> str:
    return cell if isinstance(cell, str) else f"{cell:.3g}"
