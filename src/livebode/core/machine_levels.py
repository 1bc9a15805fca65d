"""The levels of a machine's path, from the site down."""

from __future__ import annotations

from typing import Final, Literal, get_args

Level = Literal["site", "line", "machine", "axis"]
LEVELS: Final[tuple[Level, ...]] = get_args(Level)
