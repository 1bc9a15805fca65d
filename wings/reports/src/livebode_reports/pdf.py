"""A document as PDF/A-2a and PDF/UA-1: an archive can keep it, and a screen reader reads it (extra `pdf`: Typst).

Typst refuses to write a file that does not conform. The layout is report.typ, which gets the document as JSON: text
from data is never read as markup.
"""

from __future__ import annotations

import json
import re
import struct
import tempfile
from dataclasses import field
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import typst

from livebode.core import (
    Answer,
    Document,
    Finding,
    Listing,
    OutputError,
    Paragraph,
    Part,
    Picture,
    PrintedTable,
    Section,
    not_installed,
)
from livebode.dataclass import dataclass
from livebode.language import current_language, worded
from livebode.pictures import LIGHT, columns
from livebode_reports.html import readable
from livebode_reports.page_style import TONE_COLOURS
from livebode_reports.svg import pictures_svg

_PLAIN, _FIXED = "DejaVu Sans", "DejaVu Sans Mono"
_WIDE_FAMILIES = (
    "Noto Sans CJK SC", "Noto Sans SC", "Source Han Sans SC", "Microsoft YaHei", "PingFang SC", "SimHei",
    "WenQuanYi Micro Hei",
)  # fmt: skip
_WIDE = re.compile("[\u2e80-\u9fff\uf900-\ufaff\uff00-\uffef]")
_EXAMPLES = "频率响应"
_UNKNOWN = "\ufffd"


@dataclass(frozen=True)
class Letters:
    """The fonts of a document, and the letters that they have.

    Attributes
    ----------
    fonts, fixed_fonts
        Families, in the order in which a letter is looked for.
    folders
        Where they are.
    """

    fonts: tuple[str, ...]
    fixed_fonts: tuple[str, ...]
    folders: tuple[str, ...]
    _codes: frozenset[int] = field(repr=False)

    def known(self, text: str) -> str:
        """The text with the sign for an unknown letter where no font has it: PDF/A permits no gap."""
        return "".join(c if ord(c) in self._codes or c in "\n\t" else _UNKNOWN for c in text)


def letters_of(text: str) -> Letters:
    """The fonts for this text.

    Raises
    ------
    OutputError
        If the language is Chinese and this computer has no font for that.
    """
    folder = _folder()
    # A heading needs the bold letter, for which the other is not used.
    codes = _codes(folder / "DejaVuSans.ttf") & _codes(folder / "DejaVuSans-Bold.ttf")
    if not _WIDE.search(text):
        return Letters((_PLAIN,), (_FIXED, _PLAIN), (str(folder),), codes)
    font = _wide_font()
    if font is None:
        if current_language().code.startswith("zh"):
            raise OutputError(
                "no-font",
                "this computer has no font with Chinese letters, and a PDF for archives contains its fonts",
                "install one (Debian: fonts-wqy-microhei), or print the page from a browser",
            )
        return Letters((_PLAIN,), (_FIXED, _PLAIN), (str(folder),), codes)
    family, path = font
    fonts = (_PLAIN, family)
    return Letters(fonts, (_FIXED, *fonts), (str(folder), str(Path(path).parent)), codes | _wide_codes(path))


def _folder() -> Path:
    """Where the fonts are that Matplotlib brings; to import it would take half of a report's time."""
    found = find_spec("matplotlib")
    if found is None or found.origin is None:
        raise not_installed("a PDF needs the fonts of Matplotlib", package="matplotlib", extra="pdf")
    return Path(found.origin).parent / "mpl-data" / "fonts" / "ttf"


@cache
def _codes(path: Path) -> frozenset[int]:
    """The letters of a font: its groups of codes (OpenType, "cmap" in format 12)."""
    data = path.read_bytes()
    tables = {data[at : at + 4]: at for at in range(12, 12 + 16 * int.from_bytes(data[4:6], "big"), 16)}
    (table,) = struct.unpack_from(">I", data, tables[b"cmap"] + 8)
    (count,) = struct.unpack_from(">H", data, table + 2)
    maps = [table + struct.unpack_from(">I", data, table + 8 + 8 * i)[0] for i in range(count)]
    groups = next(at for at in maps if data[at : at + 2] == b"\0\x0c")
    (number,) = struct.unpack_from(">I", data, groups + 12)
    ends = (struct.unpack_from(">II", data, groups + 16 + 12 * i) for i in range(number))
    return frozenset(code for first, last in ends for code in range(max(first, 32), last + 1))


@cache
def _wide_codes(path: str) -> frozenset[int]:
    from matplotlib.ft2font import FT2Font

    return frozenset(code for code in FT2Font(path).get_charmap() if code >= 32)


@cache
def _wide_font() -> tuple[str, str] | None:
    """Family and file of a font of this computer with Chinese letters, a preferred one if there is any."""
    from matplotlib.font_manager import findSystemFonts

    fonts = [font for path in findSystemFonts() if (font := _family(path)) is not None]
    ranks = {family: i for i, family in enumerate(_WIDE_FAMILIES)}
    return min(fonts, key=lambda font: (ranks.get(font[0], len(ranks)), font[1]), default=None)


def _family(path: str) -> tuple[str, str] | None:
    from matplotlib.ft2font import FT2Font

    try:
        font = FT2Font(path)
    except (OSError, RuntimeError):
        return None
    if not all(font.get_char_index(ord(letter)) for letter in _EXAMPLES):
        return None
    # A collection for several languages names the first of them.
    return font.family_name.replace("CJK JP", "CJK SC"), path


STANDARDS = ("a-2a", "ua-1")
_SHORT, _LETTERS_MAX = 30, 60  # letters of a column, when the widths of a table's columns are shared out


def save_pdf(document: Document, path: Path, drawn: tuple[str, ...] | None = None) -> None:
    """Write the document; the same document gives the same bytes.

    Parameters
    ----------
    document
        The report.
    path
        The file.
    drawn
        The pictures, as from `pictures_svg`, if they are drawn already.

    Raises
    ------
    OSError
        If the file cannot be written.
    OutputError
        If no font of this computer has the letters of the language, or the content cannot be archived.
    """
    svgs = pictures_svg(document) if drawn is None else drawn
    written = json.dumps(_Data(document).plain(), ensure_ascii=False)
    letters = letters_of(written + "".join(svgs))
    # Paths of the machine do not appear in the file: all names are relative to the folder.
    contents = {f"{i}.svg": letters.known(svg).encode() for i, svg in enumerate(svgs)} | {
        "document.json": letters.known(written).encode(),
        "main.typ": (files("livebode_reports") / "report.typ").read_bytes(),
    }
    if document.logo is not None:
        contents[f"logo.{document.logo.kind}"] = document.logo.data
    path.write_bytes(_compiled(contents, letters, int(document.made.timestamp())))


def _compiled(contents: dict[str, bytes], letters: Letters, made_s: int) -> bytes:
    """The PDF of main.typ in these files."""
    compile_pdf: Any = typst.compile
    fonts = {"fonts": json.dumps(letters.fonts), "fixed_fonts": json.dumps(letters.fixed_fonts)}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, data in contents.items():
            (folder / file).write_bytes(data)
        try:
            document = compile_pdf(
                folder / "main.typ", root=folder, font_paths=list(letters.folders), ignore_system_fonts=True,
                sys_inputs=fonts, pdf_standards=list(STANDARDS), timestamp=made_s,
            )  # fmt: skip
        except typst.TypstError as error:
            raise _not_archivable(error) from None
    return bytes(document)


def _not_archivable(error: typst.TypstError) -> OutputError:
    return OutputError(
        "not-archivable",
        f"the report cannot be written as PDF/A: {error.message}",
        "print the page from a browser, and report this",
        hints=list(error.hints),
    )


class _Data:
    """The document as plain data for report.typ."""

    def __init__(self, document: Document) -> None:
        self._of = document
        self._files = {id(picture): f"{i}.svg" for i, picture in enumerate(document.pictures)}

    def plain(self) -> dict[str, Any]:
        of, text = self._of, readable
        lang, _, region = current_language().code.partition("-")
        logo = None if of.logo is None else {"file": f"logo.{of.logo.kind}", "text": text(of.logo.text)}
        return {
            "name": text(f"{of.title}: {of.kind}"), "author": "livebode", "paper": _PAPERS[of.paper], "lang": lang,
            "region": region or None,
            "colours": {"ink": LIGHT.ink, "muted": LIGHT.muted, "grid": LIGHT.grid},
            "tone_colours": TONE_COLOURS, "subject": text(of.kind), "title": _heading(of.title), "foot": text(of.foot),
            "heading": _heading(of.heading), "facts": [list(map(text, pair)) for pair in of.facts], "logo": logo,
            "answers": [self._answer(a) for a in of.answers], "about_answers": text(of.about_answers),
            "verdict": [self._finding(f) for f in of.verdict], "result": [self._finding(f) for f in of.result],
            "picture": None if of.picture is None else self._part(of.picture),
            "signatures": list(map(text, of.signatures)),
            "sections": [self._section(section) for section in of.sections],
            "appendix": [self._section(section) for section in of.appendix],
        }  # fmt: skip

    def _finding(self, finding: Finding) -> dict[str, str]:
        word = readable(worded(self._of.tones[finding.tone]))
        return {"tone": finding.tone, "word": word, "text": readable(finding.text)}

    def _answer(self, answer: Answer) -> dict[str, Any]:
        word = "" if answer.tone is None else worded(self._of.tones[answer.tone])
        texts = {name: readable(value) for name, value in vars(answer).items() if name != "tone"}
        return texts | {"tone": answer.tone or "open", "word": readable(word)}

    def _section(self, section: Section) -> dict[str, Any]:
        return {"title": _heading(section.title), "parts": [self._part(part) for part in section.parts]}

    def _part(self, part: Part) -> dict[str, Any]:
        text = readable
        if isinstance(part, Paragraph):
            return {"kind": "paragraph", "text": text(part.text)}
        if isinstance(part, Listing):
            return {"kind": "listing", "text": text(part.text)}
        if isinstance(part, Picture):
            caption = text(part.caption)
            return {"kind": "picture", "file": self._files[id(part)], "caption": caption}
        headings = list(map(text, part.headings)) if any(part.headings) else []
        rows = [list(map(text, row)) for row in part.rows]
        return {
            "kind": "table", "headings": headings, "rows": rows, "numbers": list(part.numbers),
            "note": text(part.note), "widths": _widths(part),
        }  # fmt: skip


def _heading(text: str) -> str:
    """PDF/UA permits no empty heading."""
    return readable(text).strip() or "—"


_PAPERS = {"a4": "a4", "letter": "us-letter"}


def _widths(table: PrintedTable) -> list[int]:
    """Shares of the page for the columns; 0 for a column that is as wide as its text, beside one with long texts."""
    every = [table.headings, *table.rows]
    letters = [max(columns(texts[i]) for texts in every) for i in range(len(table.headings))]
    if max(letters, default=0) > _SHORT:
        return [0 if n <= _SHORT else min(n, _LETTERS_MAX) for n in letters]
    return [max(n + 2, 6) for n in letters]
