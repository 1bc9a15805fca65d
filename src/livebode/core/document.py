"""Document: the content of a report as plain data, independent of the page layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from livebode.language import marked

Tone = Literal["ok", "check", "alarm", "differs", "open"]
"""Nothing to do; a person should look; an alarm is active; two runs differ; not assessed."""

TONES: Mapping[str, str] = {
    "ok": marked("OK"),
    "check": marked("check"),
    "alarm": marked("ALARM"),
    "differs": marked("differs"),
    "open": marked("not assessed"),
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
    """Rows of texts below headings; `numbers` are the right-aligned columns, `note` a line below."""

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """A picture that is not drawn yet: its kind, its data, and its caption."""

    what: str
    data: Mapping[str, Any]
    caption: str


@dataclass(frozen=True)
class Listing:
    """Preformatted text, such as a configuration."""

    text: str


Part = Paragraph | Table | Picture | Listing


@dataclass(frozen=True)
class Section:
    """A heading and the content below it."""

    title: str
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Document:
    """A report: title, facts of the title block, the verdict, and sections.

    Attributes
    ----------
    kind
        Kind of the report, above the title.
    title
        Subject of the report.
    facts
        Names and values of the title block.
    verdict
        Findings, the most urgent first.
    sections
        In the order of reading.
    foot
        Printed at the end, and at the foot of each page of a PDF.
    heading
        Heading of the verdict.
    tones
        The verdict that is printed for each tone, so that it is legible without colours.
    """

    kind: str
    title: str
    facts: tuple[tuple[str, str], ...]
    verdict: tuple[Finding, ...]
    sections: tuple[Section, ...]
    foot: str = ""
    heading: str = ""
    tones: Mapping[str, str] = field(default_factory=lambda: TONES)
