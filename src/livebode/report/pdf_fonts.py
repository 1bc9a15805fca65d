"""Fonts of a PDF: Matplotlib's, which it contains, and one for wide (Chinese) letters."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import matplotlib
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.cidfonts import UnicodeCIDFont
from reportlab.pdfbase.ttfonts import TTFError, TTFont

PLAIN, BOLD, FIXED = "DejaVuSans", "DejaVuSans-Bold", "DejaVuSansMono"
# Families with TrueType outlines; ReportLab cannot embed others, such as Noto Sans CJK.
_WIDE_FAMILIES = (
    "Microsoft YaHei", "SimHei", "SimSun", "WenQuanYi Micro Hei", "WenQuanYi Zen Hei", "Droid Sans Fallback",
    "Arial Unicode MS", "Heiti SC",
)  # fmt: skip
_WIDE_RUN = re.compile("([\u2e80-\u9fff\uf900-\ufaff\uff00-\uffef]+)")


def register_fonts() -> None:
    """Register Matplotlib's fonts, which contain the required symbols, with ReportLab."""
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    for name in (PLAIN, BOLD, FIXED):
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, folder / f"{name}.ttf"))


@cache
def wide_font() -> str:
    """Name of a registered font with Chinese letters.

    A font of this computer, which the file then contains; without one a name for which the reader needs its own font.
    """
    from matplotlib.font_manager import fontManager

    found = {font.name: font.fname for font in fontManager.ttflist}
    for path in (found[family] for family in _WIDE_FAMILIES if family in found):
        try:
            pdfmetrics.registerFont(TTFont("wide", path))
        except (TTFError, OSError):
            continue
        return "wide"
    pdfmetrics.registerFont(UnicodeCIDFont("STSong-Light"))
    return "STSong-Light"


def runs(text: str) -> list[tuple[str, bool]]:
    """The text in runs of one font each; whether it is the one of the wide letters.

    >>> runs("Ms 灵敏度 2")
    [('Ms ', False), ('灵敏度', True), (' 2', False)]
    """
    return [(run, i % 2 == 1) for i, run in enumerate(_WIDE_RUN.split(text)) if run]
