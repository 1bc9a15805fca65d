"""Baselines that cannot be learned or used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class BaselineError(LivebodeError):
    """A baseline cannot be learned, read, or compared with this run."""

    area: ClassVar[str] = "baseline"
    codes: ClassVar[Mapping[str, str]] = {
        "absent": "There is no file at the path of the baseline.",
        "covariate-constant": "A covariate has one value in all runs, so its influence cannot be learned.",
        "covariate-unknown": "No window of steady motion has a value of the covariates.",
        "covariates-correlated": "Two covariates vary together, so their influences cannot be told apart.",
        "damaged": "A value in the file of the baseline is missing or cannot be used.",
        "not-a-baseline": "The file is not a baseline.",
        "settings-differ": "The baseline was learned with other settings than those of the run.",
        "too-few-windows": "The runs have too few windows to learn a baseline from.",
        "unreadable": "The system cannot read the file of the baseline.",
        "version": "The baseline was written by another version of livebode, in another format.",
    }
