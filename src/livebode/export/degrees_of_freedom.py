"""Degrees of freedom of a structure as modal analysis names them: a node and a direction, such as 12+Z."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from livebode.core import UsageError

_WRITTEN = re.compile(r"(?P<node>\d{1,10})(?:(?P<sign>[+-])(?P<direction>R?[XYZ]))?")
_DIRECTIONS = ("X", "Y", "Z", "RX", "RY", "RZ")


class DegreeOfFreedom(NamedTuple):
    """A node, and its direction as in UFF 58: 0 scalar; 1, 2, 3 along X, Y, Z; 4, 5, 6 around them; negative against.

    >>> DegreeOfFreedom.parse("12-Z"), DegreeOfFreedom.parse("3+RX").direction, str(DegreeOfFreedom(4, 0))
    (DegreeOfFreedom(node=12, direction=-3), 4, '4')
    """

    node: int
    direction: int

    @classmethod
    def parse(cls, text: str) -> DegreeOfFreedom:
        """A node with sign and direction, or a node alone for a scalar; UsageError for another text."""
        match = _WRITTEN.fullmatch(text.strip().upper())
        if match is None:
            raise UsageError(
                "out-of-range",
                f"{text!r} is not a degree of freedom",
                "give a node, a sign and a direction such as 12+X, 12-Z or 12+RZ, or a node alone",
                argument="dofs",
                value=text,
            )
        if match["direction"] is None:
            return cls(int(match["node"]), 0)
        number = 1 + _DIRECTIONS.index(match["direction"])
        return cls(int(match["node"]), -number if match["sign"] == "-" else number)

    def __str__(self) -> str:
        if not self.direction:
            return str(self.node)
        return f"{self.node}{'-' if self.direction < 0 else '+'}{_DIRECTIONS[abs(self.direction) - 1]}"


def numbered(names: Sequence[str], given: Mapping[str, DegreeOfFreedom]) -> list[DegreeOfFreedom]:
    """The degree of freedom of each signal: the given one, else the node with its number from 1, as a scalar."""
    return [given.get(name, DegreeOfFreedom(number, 0)) for number, name in enumerate(names, start=1)]
