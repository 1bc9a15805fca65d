"""Real recordings with known answers, beside the repository; tests that need them are skipped where they are not."""

from __future__ import annotations

from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2].parent / "shared" / "data"


def recording(name: str) -> Path:
    """Path of a recording, or a skip that says what is missing."""
    path = FOLDER / name
    if not path.is_file():
        pytest.skip(f"the real recording {name} is not beside the repository (../shared/data)")
    return path
