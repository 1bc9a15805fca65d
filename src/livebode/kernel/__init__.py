"""The sliding DFT, the line stage, the verdicts on lines and the fit in C, and their NumPy twins, the definitions.

The twins are `livebode.kernel.twin`, `livebode.kernel.line_twin`, `livebode.estimation.repeating_twin` and
`livebode.kernel.fit_twin`.
"""

from livebode.kernel._fit import (
    RIGID,
    TWO_MASS,
    TWO_MASS_GAIN,
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
from livebode.kernel._instructions import chosen as chosen_instruction_set
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
    NewestWindows,
    WeightSums,
    process_each,
    process_lines,
)
from livebode.kernel._repeating import (
    ADDED,
    FORGOTTEN,
    JUDGED,
    NEWS,
    NEWS_GONE,
    NEWS_INVALID,
    REASONS,
    PeriodSpectra,
    PeriodState,
    PeriodVerdicts,
    RepeatingPlan,
    RepeatingSettings,
    Tones,
    judge_periods,
)
from livebode.kernel._sizes import largest_sizes
from livebode.kernel._sliding import SlidingDFT

__all__ = [
    "ADDED",
    "FORGOTTEN",
    "INSTRUCTION_SET_VARIABLE",
    "JUDGED",
    "MEANS",
    "NEWS",
    "NEWS_GONE",
    "NEWS_INVALID",
    "NOISE_LARGER",
    "NOISE_MOVING",
    "NOISE_SCATTER",
    "REASONS",
    "RIGID",
    "SCATTER",
    "TWO_MASS",
    "TWO_MASS_GAIN",
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
    "NewestWindows",
    "PeriodSpectra",
    "PeriodState",
    "PeriodVerdicts",
    "RepeatingPlan",
    "RepeatingSettings",
    "SlidingDFT",
    "Tones",
    "WeightSums",
    "chosen_instruction_set",
    "fft_is_cheaper",
    "fit",
    "fit_epsilon",
    "fit_margins",
    "fit_response",
    "instruction_set",
    "instruction_sets",
    "judge_periods",
    "largest_sizes",
    "process_each",
    "process_lines",
]
