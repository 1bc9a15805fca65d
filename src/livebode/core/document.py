"""Document: what a report says, as plain data, before anybody lays it out on a page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Tone = Literal["ok", "check", "alarm", "differs", "open"]
"""Nothing to do; a person should look; an alarm is active; two runs differ; not assessed."""

TONES: Mapping[str, str] = {
    "ok": "OK",
    "check": "check",
    "alarm": "ALARM",
    "differs": "differs",
    "open": "not assessed",
}
"""The verdict that is printed for each tone."""


@dataclass(frozen=True)
class Finding:
    """One sentence of the verdict, and how urgent it is."""

    tone: Tone
    text: str


@dataclass(frozen=True)
class Paragraph:
    """Sentences."""

    text: str


@dataclass(frozen=True)
class Table:
    """Rows of texts below headings; `numbers` are the columns that stand to the right, `note` a line below."""

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """A picture that is still to be drawn: which one, of what data, and the line below it."""

    what: str
    data: Mapping[str, Any]
    caption: str


@dataclass(frozen=True)
class Listing:
    """Text that keeps its lines, such as a configuration."""

    text: str


Part = Paragraph | Table | Picture | Listing


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it."""

    title: str
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Document:
    """A report: title, facts of the title block, the verdict, and sections.

    Attributes
    ----------
    kind
        What it is, above the title.
    title
        What it is about.
    facts
        Names and values of the title block.
    verdict
        Findings, the most urgent first.
    sections
        In the order of reading.
    foot
        Stands at the end, and at the foot of each page of a PDF.
    asked
        Heading of the verdict.
    tones
        The verdict that is printed for each tone, so that it is known without colours.
    """

    kind: str
    title: str
    facts: tuple[tuple[str, str], ...]
    verdict: tuple[Finding, ...]
    sections: tuple[Section, ...]
    foot: str = ""
    asked: str = "Verdict"
    tones: Mapping[str, str] = field(default_factory=lambda: TONES)
