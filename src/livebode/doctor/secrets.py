"""Secrets removed: from a configuration by its models, from other texts by what was removed there.

A key that no model has is not trusted: its value may be a password that was written in the wrong place.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from livebode.configuration import MAY_BE_SECRET, Axis, FileKind
from livebode.core import LivebodeError
from livebode.plugins import loaded
from livebode.sources.live import parse_address, secret

REMOVED = "[removed]"
_SECRET_NAME = re.compile(r"pass(word|wd|phrase)|secret|token|credential|auth|user|login|api_?key", re.IGNORECASE)
_USER_IN_URL = re.compile(r"(?<=://)[^\s\"'<>]*(?=@)")
_QUERY_IN_URL = re.compile(r"https?://[^\s\"'<>?]*\?([^\s\"'<>]+)")
_PIECES = re.compile(r"[^\w.%+~-]+")
_LETTERS_MIN = 4
"""A shorter text is not looked for in others: it is in many words."""


class Secrets:
    """Removes secrets, and remembers which it has removed.

    Parameters
    ----------
    folder
        Where relative paths of a configuration are from.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._found: set[str] = set()

    def configuration(self, table: Mapping[str, Any], kind: FileKind | None = None) -> dict[str, Any]:
        """A configuration, valid or not, as plain data without secrets."""
        if kind is not None:
            return self._fields(table, loaded(kind.model))
        shared = {key: value for key, value in table.items() if key != "axes"}
        kept = self._fields(shared, Axis)
        if "axes" in table:
            axes = table["axes"]
            several = isinstance(axes, Mapping)
            kept["axes"] = {name: self._section(axis, Axis) for name, axis in axes.items()} if several else REMOVED
        return kept

    def plain(self, value: Any) -> Any:
        """Plain data without what was removed before, users in URLs, and values of keys that name a secret."""
        if isinstance(value, Mapping):
            return {
                self.text(str(key)): REMOVED if _SECRET_NAME.search(str(key)) else self.plain(inner)
                for key, inner in value.items()
            }
        if isinstance(value, list | tuple):
            return [self.plain(inner) for inner in value]
        return value if isinstance(value, int | float | None) else self.text(str(value))

    def text(self, text: str) -> str:
        """A text without what was removed before, and without users and queries in URLs."""
        for secret_part in (*_USER_IN_URL.findall(text), *_QUERY_IN_URL.findall(text)):
            self._removed(secret_part)
        for found in sorted(self._found, key=len, reverse=True):
            text = text.replace(found, REMOVED)
        return text

    def _section(self, table: Any, model: type[BaseModel]) -> Any:
        if isinstance(table, list):
            return [self._section(one, model) for one in table]
        if not isinstance(table, Mapping):
            return self._removed(table)
        return self._fields(table, model)

    def _fields(self, table: Mapping[str, Any], model: type[BaseModel]) -> dict[str, Any]:
        return {key: self._field(key, value, model) for key, value in table.items()}

    def _field(self, key: str, value: Any, model: type[BaseModel]) -> Any:
        field = model.model_fields.get(key)
        if field is None:
            return self._removed(value) if _SECRET_NAME.search(key) else REMOVED
        if key in MAY_BE_SECRET:
            return self._kept_where_harmless(key, value)
        inner = next(_models(field.annotation), None)
        return self.plain(value) if inner is None else self._section(value, inner)

    def _kept_where_harmless(self, key: str, value: Any) -> Any:
        """The name of a variable or file that is there, or an address; anything else may be the secret itself."""
        if not isinstance(value, str):
            return self._removed(value)
        name, _, kind = key.rpartition("_")
        if kind == "env" and value in os.environ:
            self._remember(name, variable=value)
            return value
        if kind == "file" and (path := self._folder / value).is_file():
            self._remember(name, path=path)
            return value
        if key == "url":
            try:
                parse_address(value)
                return value
            except LivebodeError:
                return self._removed(value)
        return REMOVED if key == "username" else self._removed(value)

    def _remember(self, name: str, variable: str | None = None, path: Path | None = None) -> None:
        try:
            self._note(secret("", name, variable, path) or "")
        except LivebodeError:
            return  # it cannot be read by us, so that nothing holds it

    def _removed(self, value: Any) -> str:
        """The mark in the place of a value, which no other text may repeat, not in pieces either."""
        for text in _texts(value):
            self._note(text)
            for piece in _PIECES.split(text.partition("://")[2] or text):
                self._note(piece)
        return REMOVED

    def _note(self, text: str) -> None:
        if len(text) >= _LETTERS_MIN:
            self._found.add(text)


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """The models in a field's annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models(inner)


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        for inner in value.values():
            yield from _texts(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _texts(inner)
    elif isinstance(value, str):
        yield value
