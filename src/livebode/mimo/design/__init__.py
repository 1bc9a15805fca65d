"""The experiment on several inputs for a machine, its limits, and a required accuracy or the available time."""

from livebode.mimo.design.choose import choose_matrix
from livebode.mimo.design.machine import LimitedPeak, MatrixLimits, MatrixMachine
from livebode.mimo.design.measured import MeasuredMachine
from livebode.mimo.design.mechanism import MechanismMachine
from livebode.mimo.design.result import Alternative, MatrixDesign
from livebode.mimo.design.spec import MatrixSpec

__all__ = [
    "Alternative",
    "LimitedPeak",
    "MatrixDesign",
    "MatrixLimits",
    "MatrixMachine",
    "MatrixSpec",
    "MeasuredMachine",
    "MechanismMachine",
    "choose_matrix",
]
