"""Frequencies that are not lines of a grid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class GridError(LivebodeError):
    """A frequency is not a line of the grid, or data on different grids were to be combined."""

    area: ClassVar[str] = "grid"
    codes: ClassVar[Mapping[str, str]] = {
        "not-alike": "Responses on different lines were to be combined.",
    }
