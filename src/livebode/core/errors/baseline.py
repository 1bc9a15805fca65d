"""Baselines that cannot be learned or used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class BaselineError(LivebodeError):
    """A baseline cannot be learned, read, or compared with this run.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.Baseline.load("missing.json")
    ... except livebode.BaselineError as error:
    ...     print(error.code)
    baseline.absent
    """

    area: ClassVar[str] = "baseline"
    codes: ClassVar[Mapping[str, str]] = {
        "absent": "There is no file at the path of the baseline.",
        "covariate-constant": "A covariate has one value in all runs, so its influence cannot be learned.",
        "covariate-unknown": "No window of steady motion has a value of the covariates.",
        "covariates-correlated": "Two covariates vary together, so their influences cannot be told apart.",
        "covariates-without-machine": "Covariates need a model of the moving machine, and the runs give none.",
        "damaged": "A value in the file of the baseline is missing or cannot be used.",
        "newer-version": "The baseline was written by a newer version of livebode.",
        "no-runs": "There is no run to learn from.",
        "not-a-baseline": "The file is not a baseline.",
        "run-averaged": "A run's responses contain those before them, so that they are not independent.",
        "run-not-of-machine": "A run does not come from `livebode run` and so has no description of its machine.",
        "run-not-periodic": "A run is of an estimator for an excitation that does not repeat.",
        "run-repeated": "Two of the runs contain the same samples.",
        "run-without-responses": "A run has modes of the output alone, and no responses.",
        "runs-differ": "The runs have different lines, signals or options.",
        "settings-differ": "The baseline was learned with other settings than those of the run.",
        "too-few-windows": "The runs have too few windows to learn a baseline from.",
        "unreadable": "The system cannot read the file of the baseline.",
        "version": "The baseline was written by an older version of livebode, in another format.",
    }
