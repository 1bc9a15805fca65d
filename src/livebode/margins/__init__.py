"""Margins of the loop around a fitted plant, with bounds, and filters that would increase them."""

from livebode.margins.against_lines import against_lines
from livebode.margins.at_lines import peak_sensitivity_at_lines
from livebode.margins.filters import Biquad, low_pass, notch
from livebode.margins.margins import Margins
from livebode.margins.open_loop import OpenLoop
from livebode.margins.reading import margins
from livebode.margins.tuning import Proposal, Tuning, tuning, worst

__all__ = [
    "Biquad",
    "Margins",
    "OpenLoop",
    "Proposal",
    "Tuning",
    "against_lines",
    "low_pass",
    "margins",
    "notch",
    "peak_sensitivity_at_lines",
    "tuning",
    "worst",
]
