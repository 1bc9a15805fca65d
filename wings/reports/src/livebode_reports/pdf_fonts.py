"""Fonts of a PDF, which contains them: Matplotlib's, and one of this computer for Chinese letters."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from livebode.core import OutputError, needing
from livebode.language import current_language

with needing("Matplotlib", "plots", "a picture"):
    import matplotlib
    from matplotlib.ft2font import FT2Font

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
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    # A heading needs the bold letter, for which the other is not used.
    codes = _codes(str(folder / "DejaVuSans.ttf")) & _codes(str(folder / "DejaVuSans-Bold.ttf"))
    if not _WIDE.search(text):
        return Letters((_PLAIN,), (_FIXED, _PLAIN), (str(folder),), codes)
    found = _wide_font()
    if found is None:
        if current_language().code.startswith("zh"):
            raise OutputError(
                "no-font",
                "this computer has no font with Chinese letters, and a PDF for archives contains its fonts",
                "install one (Debian: fonts-wqy-microhei), or print the page from a browser",
            )
        return Letters((_PLAIN,), (_FIXED, _PLAIN), (str(folder),), codes)
    family, path = found
    fonts = (_PLAIN, family)
    return Letters(fonts, (_FIXED, *fonts), (str(folder), str(Path(path).parent)), codes | _codes(path))


@cache
def _codes(path: str) -> frozenset[int]:
    return frozenset(code for code in FT2Font(path).get_charmap() if code >= 32)


@cache
def _wide_font() -> tuple[str, str] | None:
    """Family and file of a font of this computer with Chinese letters, a preferred one if there is any."""
    from matplotlib.font_manager import findSystemFonts

    found = [one for path in findSystemFonts() if (one := _family(path)) is not None]
    ranks = {family: i for i, family in enumerate(_WIDE_FAMILIES)}
    return min(found, key=lambda one: (ranks.get(one[0], len(ranks)), one[1]), default=None)


def _family(path: str) -> tuple[str, str] | None:
    try:
        font = FT2Font(path)
    except (OSError, RuntimeError):
        return None
    if not all(font.get_char_index(ord(letter)) for letter in _EXAMPLES):
        return None
    # A collection for several languages names the first of them.
    return font.family_name.replace("CJK JP", "CJK SC"), path
