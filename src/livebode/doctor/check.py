"""Check: one question about this computer or a configuration, and its answer."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, field
from typing import Any, Literal, get_args

from livebode.core import LivebodeError
from livebode.dataclass import dataclass

Verdict = Literal["not applicable", "ok", "warning", "failed"]
"""From the least to the most urgent."""


@dataclass(frozen=True)
class Check:
    """One answer.

    Parameters
    ----------
    name
        What was checked.
    verdict
        The result.
    message
        One sentence with the value.
    remedy
        What to do, as an imperative; empty where nothing has to be done.
    facts
        The values as plain data.
    """

    name: str
    verdict: Verdict
    message: str
    remedy: str = ""
    facts: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of_error(cls, name: str, error: LivebodeError) -> Check:
        """The failed check of an error.

        >>> from livebode.core import GridError
        >>> Check.of_error("lines", GridError("line-off", "35 Hz is not a line", "take 30 Hz").at("axis.toml")).message
        'axis.toml: 35 Hz is not a line'
        """
        message = f"{error.place}: {error.message}" if error.place else error.message
        return cls(name, "failed", message, error.remedy, {"code": error.code} | error.facts)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)


def worst(verdicts: Iterable[Verdict]) -> Verdict:
    """The most urgent of these.

    >>> worst(["ok", "warning", "not applicable"]), worst([])
    ('warning', 'not applicable')
    """
    return max(verdicts, key=get_args(Verdict).index, default="not applicable")
