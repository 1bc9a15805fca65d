"""What the sections of a configuration have in common: how strict they are, and types of values."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from livebode.core import Field, TypedTable, ValueCheck
from livebode.language import available


def _known_language(code: str) -> str:
    if code not in available():
        raise ValueError(f"is not one of the languages {', '.join(available())}")
    return code


File = Annotated[Path, Field(strict=False)]
Language = Annotated[str, ValueCheck(_known_language)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class ConfigurationSection(TypedTable, extra="forbid", strict=True, allow_inf_nan=False):
    """A table that accepts its own keys only, each with its own type."""
