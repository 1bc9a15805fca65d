"""Validation of fitted models on independent data."""

from livebode.validation.correlation import LIMIT, SMALL, Correlation
from livebode.validation.lines import FittedModel, LineValidation, fitted_model, validate_at_lines
from livebode.validation.loop_equation import LoopResidual, LoopSignals
from livebode.validation.loop_images import held_path
from livebode.validation.validate import Validation, validate

__all__ = [
    "LIMIT",
    "SMALL",
    "Correlation",
    "FittedModel",
    "LineValidation",
    "LoopResidual",
    "LoopSignals",
    "Validation",
    "fitted_model",
    "held_path",
    "validate",
    "validate_at_lines",
]
