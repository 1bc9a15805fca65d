"""The sliding DFT and the line stage in C, and their NumPy twins, the readable definitions.

The twins are `livebode.kernel.twin` and `livebode.kernel.line_twin`.
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
    NewestWindows,
    WeightSums,
    add_windows,
    process_each,
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
    "LineMoments",
    "LineRows",
    "LineSettings",
    "LineWindows",
    "NewestWindows",
    "SlidingDFT",
    "WeightSums",
    "add_windows",
    "instruction_set",
    "instruction_sets",
    "process_each",
    "process_lines",
]
