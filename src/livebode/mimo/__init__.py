"""Several inputs and outputs: excitations that separate the inputs, and the tracker of response matrices."""

from livebode.core import REASONS, MatrixResponses
from livebode.mimo.example import example_matrix_responses
from livebode.mimo.excitation import MatrixExcitation
from livebode.mimo.prediction import MatrixPrediction, predict, within_limits
from livebode.mimo.settings import MatrixLoop, MatrixSettings
from livebode.mimo.tracker import MatrixTracker

__all__ = [
    "REASONS",
    "MatrixExcitation",
    "MatrixLoop",
    "MatrixPrediction",
    "MatrixResponses",
    "MatrixSettings",
    "MatrixTracker",
    "example_matrix_responses",
    "predict",
    "within_limits",
]
