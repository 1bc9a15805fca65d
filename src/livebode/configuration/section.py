"""Types of values that several sections of a configuration have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field

from livebode.language import available


def _known_language(code: str) -> str:
    if code not in available():
        raise ValueError(f"is not one of the languages {', '.join(available())}")
    return code


File = Annotated[Path, Field(strict=False)]
Language = Annotated[str, AfterValidator(_known_language)]
