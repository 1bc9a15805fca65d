"""Baselines that cannot be learned or used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class BaselineError(LivebodeError):
    """A baseline cannot be learned, read, or compared with this run."""

    area: ClassVar[str] = "baseline"
    codes: ClassVar[Mapping[str, str]] = {
        "covariates-without-machine": "Covariates need a model of the moving machine, and the runs give none.",
        "no-runs": "There is no run to learn from.",
        "run-averaged": "A run's responses contain those before them, so that they are not independent.",
        "run-not-of-machine": "A run does not come from `livebode run` and so has no description of its machine.",
        "run-repeated": "Two of the runs contain the same samples.",
        "runs-differ": "The runs have different lines, signals or options.",
    }
