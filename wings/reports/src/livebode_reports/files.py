"""Documents as files, one HTML file and a PDF if Typst is installed, and as a page of the dashboard."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from livebode.configuration import recorded_report
from livebode.core import Document, ExtraError, OutputError, UsageError, install_command
from livebode.language import in_language
from livebode.records import read_summary
from livebode_reports.first_page import trusted

_OTHERS = {".png", ".svg", ".jpg", ".csv", ".json", ".txt", ".md", ".docx"}
"""Endings of files that are not documents; any other, as of "press.2", belongs to the name."""
_NO_PDF = "no PDF: Typst is not installed; run {}, or print the page from a browser"


def write_documents(document: Document, out: Path, *, force: bool) -> tuple[list[Path], str]:
    """Write `out` with .html and, if possible, .pdf, each completely or not at all; return the files and a remark.

    Raises
    ------
    UsageError
        If `out` has the ending of a file that is not written.
    OutputError
        If a file exists and must not be replaced, or cannot be written.
    """
    from livebode.export import check_free, save
    from livebode_reports.html import to_html
    from livebode_reports.svg import pictures_svg

    if out.suffix.lower() in _OTHERS:
        remedy = "choose one of them, or omit the ending"
        raise UsageError("unreadable", f"{out} is neither .html nor .pdf", remedy, argument="out")
    base = out.with_suffix("") if out.suffix.lower() in (".html", ".pdf") else out
    page, paper = (base.with_name(base.name + ending) for ending in (".html", ".pdf"))
    check_free(paper, force=force)
    drawn = pictures_svg(document)
    save(page, lambda partial: partial.write_text(to_html(document, drawn), encoding="utf-8"), force=force)
    try:
        from livebode_reports.pdf import save_pdf
    except ImportError:
        return [page], _NO_PDF.format(install_command("pdf"))
    try:
        save(paper, lambda partial: save_pdf(document, partial, drawn), force=force)
    except (ExtraError, OutputError) as error:
        if error.code in ("extra.not-installed", "output.no-font"):
            return [page], f"no PDF: {error}"
        raise
    return [page, paper], ""


def comparison_page(before: Path, after: Path, language: str) -> str:
    """The report of two runs as a page in this language; RecordError if one is not a run."""
    from livebode_reports.compare_report import comparison_of
    from livebode_reports.html import to_html

    with in_language(language):
        comparison = comparison_of(before, after).of(before, after)
        header = trusted(recorded_report(read_summary(after)[0]), after)
        return to_html(comparison.document(datetime.now(UTC), header=header))
