"""The sliding DFT, the line stage and the fit in C, and their NumPy twins, the readable definitions.

The twins are `livebode.kernel.twin`, `livebode.kernel.line_twin` and `livebode.kernel.fit_twin`.
"""

from livebode.kernel._fit import (
    FeedbackSeries,
    FitFound,
    FitModel,
    FitRows,
    MarginGrid,
    MarginRows,
    fit,
    fit_epsilon,
    fit_margins,
    fit_response,
)
from livebode.kernel._hopping import HoppingDFT, fft_is_cheaper
from livebode.kernel._instructions import VARIABLE as INSTRUCTION_SET_VARIABLE
from livebode.kernel._instructions import instruction_set, instruction_sets
from livebode.kernel._lines import (
    MEANS,
    NOISE_LARGER,
    NOISE_MOVING,
    NOISE_SCATTER,
    SCATTER,
    LineMoments,
    LineRows,
    LineSettings,
    LineWindows,
    WeightSums,
    add_windows,
    process_lines,
)
from livebode.kernel._sliding import SlidingDFT

__all__ = [
    "INSTRUCTION_SET_VARIABLE",
    "MEANS",
    "NOISE_LARGER",
    "NOISE_MOVING",
    "NOISE_SCATTER",
    "SCATTER",
    "FeedbackSeries",
    "FitFound",
    "FitModel",
    "FitRows",
    "HoppingDFT",
    "LineMoments",
    "LineRows",
    "LineSettings",
    "LineWindows",
    "MarginGrid",
    "MarginRows",
    "SlidingDFT",
    "WeightSums",
    "add_windows",
    "fft_is_cheaper",
    "fit",
    "fit_epsilon",
    "fit_margins",
    "fit_response",
    "instruction_set",
    "instruction_sets",
    "process_lines",
]
