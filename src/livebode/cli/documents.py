"""The documents of `livebode report` and `livebode compare`: one HTML file, and a PDF if ReportLab is installed."""

from __future__ import annotations

from pathlib import Path

from livebode.core import OutputError
from livebode.core.document import Document

_NO_PDF = "no PDF: ReportLab is not installed; pip install 'livebode[pdf]', or print the page from a browser"


def write_documents(document: Document, out: Path, *, force: bool) -> tuple[list[Path], str]:
    """Write `out` with .html and, if possible, .pdf, each completely or not at all; return the files and a remark.

    Raises
    ------
    OutputError
        If a file exists and must not be replaced, or cannot be written.
    """
    from livebode.export import save
    from livebode.report.html import to_html

    base = out.with_suffix("") if out.suffix.lower() in (".html", ".pdf") else out
    page, paper = (base.with_name(base.name + ending) for ending in (".html", ".pdf"))
    if not force and paper.exists():
        raise OutputError(
            "exists",
            f"{str(paper)!r} exists already",
            "choose another --out, or replace it with --force",
            path=str(paper),
        )
    save(page, lambda partial: partial.write_text(to_html(document), encoding="utf-8"), force=force)
    try:
        from livebode.report.pdf import save_pdf
    except ImportError:
        return [page], _NO_PDF
    save(paper, lambda partial: save_pdf(document, partial), force=force)
    return [page, paper], ""
