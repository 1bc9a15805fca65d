"""Validation of fitted models on independent data."""

from livebode.validation.correlation import LIMIT, SMALL, Correlation
from livebode.validation.validate import Validation, validate

__all__ = ["LIMIT", "SMALL", "Correlation", "Validation", "validate"]
