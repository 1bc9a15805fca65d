"""Experiments: an excitation for a machine, within its limits, with the predicted accuracy."""

from livebode.design.accuracy import Accuracy, accuracy_of
from livebode.design.axis_file import axis_text
from livebode.design.belt import belt_machine
from livebode.design.choose import Design, choose
from livebode.design.explain import Choice
from livebode.design.files import FORMATS, write
from livebode.design.limits import Bearable
from livebode.design.machine import QUANTITIES, UNITS, Machine, Place
from livebode.design.measured import MeasuredResponse, measured_machine
from livebode.design.peaks import Peak, peaks, worst
from livebode.design.waveform import Waveform
from livebode.design.wish import Wish

__all__ = [
    "FORMATS",
    "QUANTITIES",
    "UNITS",
    "Accuracy",
    "Bearable",
    "Choice",
    "Design",
    "Machine",
    "MeasuredResponse",
    "Peak",
    "Place",
    "Waveform",
    "Wish",
    "accuracy_of",
    "axis_text",
    "belt_machine",
    "choose",
    "measured_machine",
    "peaks",
    "worst",
    "write",
]
