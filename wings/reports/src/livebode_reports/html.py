"""A document as one self-contained HTML file: no scripts, no network, figures as SVG."""

from __future__ import annotations

from base64 import b64encode
from html import escape

from livebode.core import Answer, Document, Finding, Listing, Paragraph, Part, Picture, PrintedTable, Section
from livebode.language import current_language, worded
from livebode_reports.page_style import STYLE_SHEET
from livebode_reports.svg import pictures_svg


def to_html(document: Document, drawn: tuple[str, ...] | None = None) -> str:
    """The page. All content of the document is text, even if it looks like a tag.

    Parameters
    ----------
    document
        The report.
    drawn
        The pictures, as from `pictures_svg`, if they are drawn already.
    """
    return _Page(document, pictures_svg(document) if drawn is None else drawn).html()


class _Page:
    def __init__(self, document: Document, drawn: tuple[str, ...]) -> None:
        self._of = document
        self._svg = {id(picture): svg for picture, svg in zip(document.pictures, drawn)}

    def html(self) -> str:
        of = self._of
        title = _text(f"{of.title}: {of.kind}")
        sections = (*of.sections, *of.appendix)
        body = "\n".join(self._section(section, i) for i, section in enumerate(sections))
        links = "".join(f'<a href="#s{i}">{_text(s.title)}</a> ' for i, s in enumerate(sections))
        verdict = f"<h2>{_text(of.heading)}</h2>\n{self._findings(of.verdict)}\n" if of.verdict else ""
        return (
            f'<!DOCTYPE html>\n<html lang="{current_language().code}">\n<head>\n<meta charset="utf-8">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            # Nothing is loaded or executed, even if a text should pass the escaping.
            "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
            'img-src data:">\n'
            f"<title>{title}</title>\n<style>\n{STYLE_SHEET}@page {{ size: {of.paper}; }}\n</style>\n</head>\n<body>\n"
            f"{self._first()}\n<nav>{links}</nav>\n<main>\n{verdict}{body}\n</main>\n"
            f"<footer>{_text(of.foot)}</footer>\n</body>\n</html>\n"
        )

    def _first(self) -> str:
        """The first page."""
        of = self._of
        facts = "".join(f"<div><dt>{_text(n)}</dt><dd>{_text(v)}</dd></div>" for n, v in of.facts)
        signatures = "".join(f"<p>{_text(s)}</p>" for s in of.signatures)
        return (
            f'<header>\n{self._logo()}<p class="kind">{_text(of.kind)}</p>\n<h1>{_text(of.title)}</h1>\n'
            f'<dl class="facts">{facts}</dl>\n{self._answers()}{self._result()}'
            + (self._picture(of.picture) if of.picture is not None else "")
            + (f'\n<div class="signatures">{signatures}</div>' if signatures else "")
            + "\n</header>"
        )

    def _logo(self) -> str:
        logo = self._of.logo
        if logo is None:
            return ""
        kind, data = {"png": "png", "svg": "svg+xml"}[logo.kind], b64encode(logo.data).decode()
        return f'<img class="logo" alt="{_text(logo.text)}" src="data:image/{kind};base64,{data}">\n'

    def _answers(self) -> str:
        of = self._of
        rows = "\n".join(
            f'<tr><th scope="row">{_text(a.name)}</th><td class="value">{_text(a.value)}</td>'
            f"<td>{_text(a.beside)}</td><td{self._tone(a)}</td></tr>"
            for a in of.answers
        )
        note = f'<p class="note">{_text(of.about_answers)}</p>\n' if of.about_answers else ""
        return f'<table class="answers"><tbody>\n{rows}\n</tbody></table>\n{note}' if of.answers else ""

    def _tone(self, answer: Answer) -> str:
        tone = answer.tone
        return ">" if tone is None else f' class="tone {tone}">{_text(worded(self._of.tones[tone]))}'

    def _result(self) -> str:
        if not self._of.result:
            return ""
        first, *more = self._of.result
        if first.tone == "open" and self._of.answers:  # there is no verdict: the answers are the largest text
            return self._findings(self._of.result)
        word = f'<p class="word {first.tone}">{_text(worded(self._of.tones[first.tone]))}</p>'
        further = self._findings(tuple(more)) if more else ""
        return f'<div class="result {first.tone}">{word}<p class="why">{_text(first.text)}</p></div>\n{further}'

    def _findings(self, findings: tuple[Finding, ...]) -> str:
        rows = "\n".join(
            f'<li><span class="tone {f.tone}">{_text(worded(self._of.tones[f.tone]))}</span>'
            f"<span>{_text(f.text)}</span></li>"
            for f in findings
        )
        return f'<ul class="verdict">\n{rows}\n</ul>'

    def _section(self, section: Section, number: int) -> str:
        parts = "\n".join(map(self._part, section.parts))
        kind = ' class="appendix"' if number == len(self._of.sections) else ""
        return f'<section id="s{number}"{kind}>\n<h2>{_text(section.title)}</h2>\n{parts}\n</section>'

    def _part(self, part: Part) -> str:
        if isinstance(part, Paragraph):
            return f"<p>{_text(part.text)}</p>"
        if isinstance(part, Listing):
            return f"<pre>{_text(part.text)}</pre>"
        return self._picture(part) if isinstance(part, Picture) else _table(part)

    def _picture(self, part: Picture) -> str:
        return f"<figure>\n{self._svg[id(part)]}\n<figcaption>{_text(part.caption)}</figcaption>\n</figure>"


def readable(text: str) -> str:
    """The text without characters that a page cannot show."""
    return "".join(c if c.isprintable() or c in "\n\t" else "\ufffd" for c in text)


def _text(text: str) -> str:
    return escape(readable(text))


def _table(table: PrintedTable) -> str:
    def cell(tag: str, column: int, text: str) -> str:
        kind = ' class="number"' if column in table.numbers else ""
        tag = tag if text else "td"  # a heading without words is announced as one
        return f"<{tag}{kind}>{_text(text)}</{tag}>"

    def row(tag: str, texts: tuple[str, ...]) -> str:
        return f"<tr>{''.join(cell(tag, i, text) for i, text in enumerate(texts))}</tr>"

    head = f"<thead>{row('th', table.headings)}</thead>" if any(table.headings) else ""
    rows = "\n".join(row("td", texts) for texts in table.rows)
    note = f'\n<p class="note">{_text(table.note)}</p>' if table.note else ""
    kind = "" if head else ' class="pairs"'
    return f'<div class="wide" tabindex="0"><table{kind}>{head}<tbody>\n{rows}\n</tbody></table></div>{note}'
