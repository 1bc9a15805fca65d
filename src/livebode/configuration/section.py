"""What the sections of a configuration have in common: how strict they are, and types of values."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from livebode.language import available


def _known_language(code: str) -> str:
    if code not in available():
        raise ValueError(f"is not one of the languages {', '.join(available())}")
    return code


File = Annotated[Path, Field(strict=False)]
Language = Annotated[str, AfterValidator(_known_language)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class ConfigurationSection(BaseModel):
    """A table that accepts its own keys only, each with its own type."""

    # Built when it is first used: the sections are built again inside of `Axis`, half of the time of its import.
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True)
