"""Template: a pattern of paths whose braces name the machine of a recording."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass

from livebode.core import LEVELS, ConfigError

_PARTS = re.compile(r"\*\*/|\*|\?|\{(\w*)\}")
_WILD = {"**/": "(?:.*/)?", "*": "[^/]*", "?": "[^/]"}


@dataclass(frozen=True)
class Template:
    """A path or URL with *, ** and ?, and with {site}, {line}, {machine} and {axis}, each the name of a directory."""

    text: str

    def checked(self, key: str = "inputs") -> None:
        """ConfigError if a name in braces is not a level of a machine, or is there twice."""
        names = [found[1] for found in _PARTS.finditer(self.text) if found[0].startswith("{")]
        for name in names:
            if name not in LEVELS or names.count(name) > 1:
                what = "is there twice" if name in LEVELS else "is not a level of a machine"
                raise ConfigError(
                    "value-invalid",
                    f"{{{name}}} in {self.text!r} {what}",
                    "write {site}, {line}, {machine} and {axis}, each once",
                    key=key,
                    value=self.text,
                )

    @property
    def pattern(self) -> str:
        """The pattern of the files, with * in place of braces.

        >>> Template("plant/{machine}/*.csv").pattern
        'plant/*/*.csv'
        """
        return re.sub(r"\{\w*\}", "*", self.text)

    def machine(self, place: str) -> dict[str, str]:
        """The levels of the machine that the path of a recording names; none if it does not match.

        >>> Template("plant/{machine}/*.csv").machine("plant/press 4/a.csv")
        {'machine': 'press 4'}
        """
        found = self._expression.fullmatch(place.replace(os.sep, "/"))
        return found.groupdict() if found else {}

    def filled(self, levels: Mapping[str, str | None]) -> str | None:
        """The path of the machine with these levels; None if a level in braces is not known.

        >>> Template("baselines/{site}-{machine}.json").filled({"site": "Graz", "machine": "press 4"})
        'baselines/Graz-press 4.json'
        """
        if not all(levels.get(found[1]) for found in _PARTS.finditer(self.text)):
            return None
        return _PARTS.sub(lambda found: levels[found[1]] or "", self.text)

    @property
    def _expression(self) -> re.Pattern[str]:
        parts, end = [], 0
        text = self.text.replace(os.sep, "/")
        for found in _PARTS.finditer(text):
            parts.append(re.escape(text[end : found.start()]))
            parts.append(_WILD.get(found[0]) or f"(?P<{found[1]}>[^/]+)")
            end = found.end()
        return re.compile("".join([*parts, re.escape(text[end:])]))
