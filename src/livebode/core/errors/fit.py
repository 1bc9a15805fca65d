"""Models that cannot be fitted or used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class FitError(LivebodeError):
    """A model cannot be fitted, or what follows from a fit (margins, validation) cannot be computed.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.fit(livebode.example_responses().sel(frequency_hz=[20]), "two-mass")
    ... except livebode.FitError as error:
    ...     print(error.code)
    fit.too-few-lines
    """

    area: ClassVar[str] = "fit"
    codes: ClassVar[Mapping[str, str]] = {
        "loop-unknown": "Margins need the controllers of the loop, which are not described.",
        "no-continuous-model": "The discrete model has no counterpart in continuous time.",
        "no-model": "No model of the machine fits the responses.",
        "not-causal": "A model with a negative delay has no discrete counterpart.",
        "not-fitted": "The fit failed, so that there is no model to use.",
        "not-proper": "The numerator's degree is too high, or there are too many integrators.",
        "too-few-lines": "There are too few lines for the parameters of the model.",
    }
