"""A document as one self-contained HTML file: no scripts, no network, figures as SVG."""

from __future__ import annotations

from html import escape

from livebode.core.document import Document, Listing, Paragraph, Part, Picture, Section, Table
from livebode.language import current_language, recognised
from livebode.report.figures import drawn
from livebode.report.page_style import STYLE_SHEET
from livebode.report.svg import inline_svg


def to_html(document: Document) -> str:
    """The page. All content of the document is text, even if it looks like a tag."""
    title = _text(f"{document.title}: {document.kind}")
    body = "\n".join(_section(section, i) for i, section in enumerate(document.sections))
    facts = "".join(f"<div><dt>{_text(n)}</dt><dd>{_text(v)}</dd></div>" for n, v in document.facts)
    links = "".join(f'<a href="#s{i}">{_text(s.title)}</a> ' for i, s in enumerate(document.sections))
    return (
        f'<!DOCTYPE html>\n<html lang="{current_language().code}">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # Nothing is loaded or executed, even if a text should pass the escaping.
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
        'img-src data:">\n'
        f"<title>{title}</title>\n<style>\n{STYLE_SHEET}</style>\n</head>\n<body>\n"
        f'<header>\n<p class="kind">{_text(document.kind)}</p>\n<h1>{_text(document.title)}</h1>\n'
        f'<dl class="facts">{facts}</dl>\n</header>\n'
        f'<h2>{_text(document.heading)}</h2>\n<ul class="verdict">\n{_verdict(document)}\n</ul>\n'
        f"<nav>{links}</nav>\n<main>\n{body}\n</main>\n<footer>{_text(document.foot)}</footer>\n</body>\n</html>\n"
    )


def readable(text: str) -> str:
    """The text without characters that a page cannot show."""
    return "".join(c if c.isprintable() or c in "\n\t" else "\ufffd" for c in text)


def _text(text: str) -> str:
    return escape(readable(text))


def _verdict(document: Document) -> str:
    return "\n".join(
        f'<li><span class="tone {f.tone}">{_text(recognised(document.tones[f.tone]))}</span>'
        f"<span>{_text(f.text)}</span></li>"
        for f in document.verdict
    )


def _section(section: Section, number: int) -> str:
    parts = "\n".join(_part(part, f"s{number}p{i}") for i, part in enumerate(section.parts))
    return f'<section id="s{number}">\n<h2>{_text(section.title)}</h2>\n{parts}\n</section>'


def _part(part: Part, name: str) -> str:
    if isinstance(part, Paragraph):
        return f"<p>{_text(part.text)}</p>"
    if isinstance(part, Listing):
        return f"<pre>{_text(part.text)}</pre>"
    if isinstance(part, Picture):
        caption = _text(part.caption)
        return f"<figure>\n{inline_svg(drawn(part), caption, name)}\n<figcaption>{caption}</figcaption>\n</figure>"
    return _table(part)


def _table(table: Table) -> str:
    def cell(tag: str, column: int, text: str) -> str:
        kind = ' class="number"' if column in table.numbers else ""
        return f"<{tag}{kind}>{_text(text)}</{tag}>"

    def row(tag: str, texts: tuple[str, ...]) -> str:
        return f"<tr>{''.join(cell(tag, i, text) for i, text in enumerate(texts))}</tr>"

    head = f"<thead>{row('th', table.headings)}</thead>" if any(table.headings) else ""
    rows = "\n".join(row("td", texts) for texts in table.rows)
    note = f'\n<p class="note">{_text(table.note)}</p>' if table.note else ""
    kind = "" if head else ' class="pairs"'
    return f'<div class="wide"><table{kind}>{head}<tbody>\n{rows}\n</tbody></table></div>{note}'
