"""The sliding DFT, the line stage and the verdicts on lines in C, and their NumPy twins, the readable definitions.

The twins are `livebode.kernel.twin`, `livebode.kernel.line_twin` and `livebode.estimation.repeating_twin`.
"""

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
    "SCATTER",
    "LineMoments",
    "LineRows",
    "LineSettings",
    "LineWindows",
    "PeriodSpectra",
    "PeriodState",
    "PeriodVerdicts",
    "RepeatingPlan",
    "RepeatingSettings",
    "SlidingDFT",
    "Tones",
    "WeightSums",
    "instruction_set",
    "instruction_sets",
    "judge_periods",
    "process_lines",
]
