"""Document: the content of a report as plain data, independent of the page layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from datetime import UTC, datetime
from typing import Any, Literal

from livebode.core.errors.inputs import ExtraError
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.plugins import loaded, named

Paper = Literal["a4", "letter"]


Tone = Literal["ok", "check", "alarm", "differs", "open", "pass", "fail", "undecided"]
"""Nothing to do; a person should look; an alarm is active; two runs differ; not assessed; and the three results of a
limit: inside by more than the bound, outside by more than the bound, too close to decide."""

TONES: Mapping[str, str] = {
    "ok": Message("OK"),
    "check": Message("check"),
    "alarm": Message("ALARM"),
    "differs": Message("differs"),
    "open": Message(Message("not assessed")),
    "pass": Message("PASS"),
    "fail": Message("FAIL"),
    "undecided": Message(Message("not decided")),
}
"""The verdict that is printed for each tone."""


Subject = Literal["machine", "measurement"]


@dataclass(frozen=True)
class Finding:
    """One sentence, how urgent it is, and whether it is about the machine or about how well it was measured."""

    tone: Tone
    text: str
    subject: Subject = "machine"


@dataclass(frozen=True)
class Answer:
    """A quantity that was measured: its value or change with bound and unit, and the result.

    `beside` is its limit, or the values before and after.
    """

    name: str
    value: str
    beside: str = ""
    tone: Tone | None = None


@dataclass(frozen=True)
class Paragraph:
    """Sentences."""

    text: str


@dataclass(frozen=True)
class PrintedTable:
    """Rows of texts below headings; `numbers` are the right-aligned columns, `note` a line below."""

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """A picture that is not drawn yet: its kind, its data, and its caption.

    The kind of a plug-in is "module:function" of what makes its `livebode.pictures.Figure`, called with the data.
    """

    what: str
    data: Mapping[str, Any]
    caption: str


@dataclass(frozen=True)
class Listing:
    """Preformatted text, such as a configuration."""

    text: str


Part = Paragraph | PrintedTable | Picture | Listing


@dataclass(frozen=True)
class Section:
    """A heading and the content below it."""

    title: str
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Logo:
    """The bytes of a picture, "png" or "svg", and the text that replaces it for a screen reader."""

    data: bytes
    kind: Literal["png", "svg"]
    text: str


@dataclass(frozen=True)
class Document:
    """A report: a first page with the answers and the verdict, findings, sections, and an appendix.

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
        Heading of the findings.
    tones
        The verdict that is printed for each tone, so that it is legible without colours.
    answers, about_answers
        What was measured, the most important quantity first: the largest text of the first page. And what its bounds
        cover.
    result
        The findings of the first page: the first is the verdict of the report.
    picture
        The picture of the first page.
    signatures
        What each signature line is for.
    appendix
        Sections after the report itself: long tables, what was left out, raw configuration, versions.
    logo
        Shown at the top of the first page.
    paper
        Size of the pages.
    made
        Time at which the report was written.
    """

    kind: str
    title: str
    facts: tuple[tuple[str, str], ...]
    verdict: tuple[Finding, ...]
    sections: tuple[Section, ...]
    foot: str = ""
    heading: str = ""
    tones: Mapping[str, str] = field(default_factory=lambda: TONES)
    answers: tuple[Answer, ...] = ()
    about_answers: str = ""
    result: tuple[Finding, ...] = ()
    picture: Picture | None = None
    signatures: tuple[str, ...] = ()
    appendix: tuple[Section, ...] = ()
    logo: Logo | None = None
    paper: Paper = "a4"
    made: datetime = datetime(1970, 1, 1, tzinfo=UTC)

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All pictures, in the order of reading."""
        first = (self.picture,) if self.picture is not None else ()
        sections = (*self.sections, *self.appendix)
        return (*first, *(p for section in sections for p in section.parts if isinstance(p, Picture)))


def document_function(name: str) -> Any:
    """What a plug-in makes of documents: the part of this name in its table.

    `files` writes a Document as HTML and PDF: ``(document, path, *, force)`` → files and a remark. `comparison` makes
    a page of two runs: ``(before, after, language)`` → HTML.

    Raises
    ------
    ExtraError
        If no installed plug-in has it.
    """
    reference = named("documents").get(name)
    if reference is None:
        raise ExtraError(
            "not-installed",
            "documents are made by the wing reports of livebode, which is not installed",
            "install the wing reports of livebode",
            package="livebode_reports",
        )
    return loaded(reference)
