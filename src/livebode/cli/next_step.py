"""The last line of a command: what a person would want next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from livebode.cli.shell import command_line

NEXT: Mapping[str, tuple[str, ...]] = {
    "recording": ("inspect", "{place}", "--out", "axis.toml"),
    "configuration": ("run", "{place}"),
    "responses": ("fit", "{place}"),
    "fitted run": ("report", "{place}"),
    "run": ("view", "{place}"),
    "runs": ("view", "{place}"),
}
"""By what a command leaves: the words of the command that follows, with its place."""


@dataclass(frozen=True)
class Result:
    """What a command leaves, and where.

    Attributes
    ----------
    kind
        A key of `NEXT`.
    place
        Its path or URL.
    options
        Options that the command which follows needs too, as its rate.
    """

    kind: str
    place: str
    options: tuple[str, ...] = ()


def next_line(result: Result) -> str | None:
    """The line with the command that follows, to be copied; None where its wing is not installed.

    >>> next_line(Result("responses", "runs/my axis"))
    "Next: livebode fit 'runs/my axis'"
    """
    from livebode.plugins import named

    words = [word.format(place=result.place) if word == "{place}" else word for word in NEXT[result.kind]]
    words += result.options
    return f"Next: {command_line('livebode', *words)}" if words[0] in named("commands") else None
