"""Experiments: an excitation for a machine, within its limits, with the predicted accuracy."""

from livebode.experiment_design.accuracy import LineAccuracy, accuracy_of
from livebode.experiment_design.axis_file import axis_text
from livebode.experiment_design.belt import belt_machine
from livebode.experiment_design.choose import choose
from livebode.experiment_design.design import Choice, Design
from livebode.experiment_design.files import FORMATS, write
from livebode.experiment_design.limits import MachineLimits
from livebode.experiment_design.machine import QUANTITIES, UNITS, Machine, OperatingPoint
from livebode.experiment_design.measured import MeasuredResponse, measured_machine
from livebode.experiment_design.peaks import Peak, peaks, worst
from livebode.experiment_design.spec import ExperimentSpec
from livebode.experiment_design.waveform import Waveform

__all__ = [
    "FORMATS",
    "QUANTITIES",
    "UNITS",
    "Choice",
    "Design",
    "ExperimentSpec",
    "LineAccuracy",
    "Machine",
    "MachineLimits",
    "MeasuredResponse",
    "OperatingPoint",
    "Peak",
    "Waveform",
    "accuracy_of",
    "axis_text",
    "belt_machine",
    "choose",
    "measured_machine",
    "peaks",
    "worst",
    "write",
]
