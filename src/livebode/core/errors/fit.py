"""Models that cannot be fitted or used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class FitError(LivebodeError):
    """A model cannot be fitted, or what follows from a fit (margins, validation) cannot be computed."""

    area: ClassVar[str] = "fit"
    codes: ClassVar[Mapping[str, str]] = {
        "not-fitted": "No model could be fitted, so that what follows from a fit is missing.",
    }
