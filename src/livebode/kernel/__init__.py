"""The sliding DFT in C, and its NumPy twin (`livebode.kernel.twin`), the readable definition."""

from livebode.kernel._instructions import VARIABLE as INSTRUCTION_SET_VARIABLE
from livebode.kernel._instructions import instruction_set, instruction_sets
from livebode.kernel._sliding import SlidingDFT

__all__ = ["INSTRUCTION_SET_VARIABLE", "SlidingDFT", "instruction_set", "instruction_sets"]
