"""The root of livebode's errors: what is wrong, with which values, and what to do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self


class LivebodeError(ValueError):
    """Something outside the program is wrong: a value, a file, a machine. Each subclass lists its codes.

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
        Where it was found, such as "axis.toml, axis x"; empty where the message says so itself.

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

    def __init__(self, code: str, message: str, remedy: str = "", **facts: object) -> None:
        super().__init__(code, message, remedy)
        self.code = f"{self.area}.{code}"
        self.message, self.remedy = message, remedy
        self.facts: dict[str, Any] = facts
        self.place = ""

    def __init_subclass__(cls) -> None:
        cls.__module__ = "livebode"  # as users import it, and so as tracebacks name it

    def __str__(self) -> str:
        place = f"{self.place}: " if self.place else ""
        return f"{place}{self.message}; {self.remedy}" if self.remedy else f"{place}{self.message}"

    def __getattr__(self, name: str) -> Any:
        facts = self.__dict__.get("facts", {})
        if name not in facts:
            raise AttributeError(f"{type(self).__name__} {self.__dict__.get('code', '')!r} has no fact {name!r}")
        return facts[name]

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (type(self), self.__dict__)

    def at(self, place: str) -> Self:
        """The same error with the place where it was found in front of its message."""
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
