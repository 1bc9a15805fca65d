"""The pages: their links lead to pages and headings that exist, and their lines are short."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "SECURITY", "STYLE")] + [
    *ROOT.glob("docs/**/*.md"),
    *ROOT.glob("wings/**/*.md"),
]
COLUMNS = 125


def prose(page: Path) -> str:
    """The page without its blocks of code."""
    return re.sub(r"^(```+).*?^\1$", "", page.read_text("utf-8"), flags=re.M | re.S)


def anchors(page: Path) -> set[str]:
    """The names of the headings in links, as GitHub and MyST form them."""
    headings = re.findall(r"^#+ +(.+?) *$", prose(page), re.M)
    plain = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower() for heading in headings]
    return {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_to_a_page_and_a_heading(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        path, _, anchor = target.partition("#")
        if "://" in path:
            continue
        there = page.parent / path if path else page
        assert there.exists(), target
        assert not anchor or anchor in anchors(there), target


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_no_line_but_of_a_table_or_a_picture_is_longer_than_the_style_allows(page: Path) -> None:
    """A row of a table and the description of a picture cannot be broken."""
    lines = enumerate(page.read_text("utf-8").splitlines(), 1)
    assert not [n for n, line in lines if len(line) > COLUMNS and not line.startswith(("|", "!["))]
