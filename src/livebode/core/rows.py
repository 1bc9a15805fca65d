"""What all batches share that hold one row for each moment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from livebode.core.errors import UsageError


def joined(parts: Sequence[Any], names: Sequence[str], what: str) -> dict[str, Any]:
    """The arrays of these names of all parts, one behind the other; UsageError where there is no part."""
    if not parts:
        raise UsageError("missing", f"there are no {what} to join", "give at least one part", argument="parts")
    return {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
