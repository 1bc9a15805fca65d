"""The root of livebode's errors: what is wrong, with which values, and what to do."""

from __future__ import annotations

import errno
from collections.abc import Mapping
from typing import Any, ClassVar, Self

from livebode.language import Message

_PASSING = frozenset(
    getattr(errno, name, None)
    for name in (
        "ENOSPC", "EDQUOT", "EIO", "EROFS", "ESTALE",
        "EAGAIN", "EBUSY", "EINTR", "ENOMEM", "ENOBUFS", "EMFILE", "ENFILE", "ETXTBSY",
        "EADDRINUSE", "EADDRNOTAVAIL", "ENETDOWN", "ENETUNREACH", "ENETRESET", "EHOSTDOWN", "EHOSTUNREACH",
        "ECONNREFUSED", "ECONNRESET", "ECONNABORTED", "ETIMEDOUT", "EPIPE", "ENODEV", "ENXIO",
    )
) - {None}  # fmt: skip
"""Errors of the system that may pass: of a disk, of resources that others use now, of a network or a device."""


class LivebodeError(ValueError):
    """An error outside the program: in a value, a file or a machine. Each subclass lists its codes.

    It is a `ValueError`, so that validators of the configuration are reported with the key they belong to.

    Parameters
    ----------
    code
        Which of the class's `codes` it is, such as "line-off"; it never changes its meaning.
    message
        What is wrong, with the value. It names arguments and keys, never options of the command line.
    remedy
        What to do about it, as an imperative; empty where nothing can be done.
    **facts
        The values that belong to the error, by name; plain data: texts, numbers, and lists of them.

    Attributes
    ----------
    code
        Area and code, such as "grid.line-off".
    message, remedy, facts
        As given; each fact is also an attribute.
    place
        Where it was found, such as "axis.toml, axis x"; empty where the message contains it.
    temporary
        Whether the same request may succeed later, such as after a full disk or without a network. The command line
        then ends with another exit code, so that a service is started again.

    Examples
    --------
    >>> from livebode.core import GridError
    >>> error = GridError("line-off", "35 Hz is not a multiple of 10 Hz", "take 30 or 40 Hz", frequency_hz=35.0)
    >>> error.code, error.frequency_hz
    ('grid.line-off', 35.0)
    >>> print(error.at("axis.toml"))
    axis.toml: 35 Hz is not a multiple of 10 Hz; take 30 or 40 Hz
    """

    area: ClassVar[str] = ""
    codes: ClassVar[Mapping[str, str]] = {}
    temporary_codes: ClassVar[frozenset[str]] = frozenset()
    """Codes of what may pass without a change of the request; where it is not known, it is assumed to."""

    def __init__(self, code: str, message: str, remedy: str = "", **facts: object) -> None:
        super().__init__(code, message, remedy)
        self.code = f"{self.area}.{code}"
        self.message, self.remedy = message, remedy
        self.facts: dict[str, Any] = facts
        self.place = ""

    def __init_subclass__(cls) -> None:
        cls.__module__ = "livebode"  # as users import it, and so as tracebacks name it

    def __str__(self) -> str:
        return str(self.words)

    @property
    def words(self) -> str:
        """The sentence with its facts, for `livebode.language.worded`."""
        sentence = self.message
        if self.remedy:
            sentence = Message("{message}; {remedy}", message=self.message, remedy=self.remedy)
        return Message("{place}: {sentence}", place=self.place, sentence=sentence) if self.place else sentence

    def __getattr__(self, name: str) -> Any:
        facts = self.__dict__.get("facts", {})
        if name not in facts:
            raise AttributeError(f"{type(self).__name__} {self.__dict__.get('code', '')!r} has no fact {name!r}")
        return facts[name]

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (type(self), self.__dict__)

    @property
    def temporary(self) -> bool:
        return self.code.partition(".")[2] in self.temporary_codes or self.facts.get("errno") in _PASSING

    def at(self, place: str) -> Self:
        """Error with the place where it was found in front of its message."""
        error = _rebuilt(type(self), self.__dict__)
        error.place = f"{place}: {self.place}" if self.place else place
        return error  # type: ignore[no-any-return]

    def as_dict(self) -> dict[str, Any]:
        """Code, place, message, remedy and facts as plain data."""
        return {name: getattr(self, name) for name in ("code", "place", "message", "remedy", "facts")}


def _rebuilt(kind: type[LivebodeError], state: Mapping[str, Any]) -> Any:
    error = kind.__new__(kind)
    error.args = (state["code"], state["message"], state["remedy"])
    error.__dict__.update(state)
    return error
