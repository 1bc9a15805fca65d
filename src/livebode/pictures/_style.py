"""Light and dark: colours of every picture, and the preparation of text from data."""

from __future__ import annotations

import unicodedata

from livebode.dataclass import dataclass


@dataclass(frozen=True)
class Style:
    """Colours of one look, after Okabe and Ito, which people with colour-vision deficiency can distinguish.

    `run` and `newest` are the colours of the Bode plot, `traces` those of the lines of the tracking plot, in an order
    in which neighbours differ most.
    """

    paper: str
    ink: str
    muted: str
    grid: str
    run: str
    newest: str
    nothing: str
    traces: tuple[str, ...]


LIGHT = Style(
    paper="#ffffff",
    ink="#1d2733",
    muted="#5b6775",
    grid="#e3e7ec",
    run="#0072b2",
    newest="#d55e00",
    nothing="#d9dde2",
    traces=(
        *("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#1d2733"),
        *("#56b4e9", "#d55e00", "#a39a00", "#6a3d9a", "#8c564b"),
    ),
)
DARK = Style(
    paper="#12181f",
    ink="#e8edf2",
    muted="#a3afbc",
    grid="#2a333d",
    run="#56b4e9",
    newest="#f0a04b",
    nothing="#39424c",
    traces=(
        *("#4aa3df", "#e69f00", "#1fc297", "#e29ac4", "#e8edf2"),
        *("#8fd3ff", "#f0723a", "#f0e442", "#b497e7", "#c49a8a"),
    ),
)


def shortened(text: str, letters: int) -> str:
    """One line of at most `letters` columns: control characters become spaces, and the middle is removed.

    >>> shortened("a channel with a long name", 15)
    'a chann…ng name'
    """
    text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    if columns(text) <= letters:
        return text
    head = tail = ""
    middle = text
    while middle:
        if columns(head) <= columns(tail):
            head, middle = head + middle[0], middle[1:]
        else:
            tail, middle = middle[-1] + tail, middle[:-1]
        if columns(head) + columns(tail) >= letters - 1:
            break
    return f"{head}…{tail}"


def columns(text: str) -> int:
    """Width in columns of a terminal or in letters of normal width; wide (East Asian) letters count twice."""
    return sum(2 if unicodedata.east_asian_width(c) in "WF" else 0 if unicodedata.combining(c) else 1 for c in text)
