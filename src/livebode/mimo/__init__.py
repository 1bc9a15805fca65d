"""Several inputs and outputs: excitations that separate the inputs, and the tracker of response matrices."""

from typing import TYPE_CHECKING

from livebode.core import REASONS, MatrixResponses
from livebode.on_first_use import on_first_use

if TYPE_CHECKING:
    from livebode.mimo.example import example_matrix_responses
    from livebode.mimo.excitation import MatrixExcitation
    from livebode.mimo.prediction import MatrixPrediction, predict, within_limits
    from livebode.mimo.settings import MatrixLoop, MatrixSettings
    from livebode.mimo.tracker import MatrixTracker

__getattr__ = on_first_use(
    __name__,
    {
        "example": ("example_matrix_responses",),
        "excitation": ("MatrixExcitation",),
        "prediction": ("MatrixPrediction", "predict", "within_limits"),
        "settings": ("MatrixLoop", "MatrixSettings"),
        "tracker": ("MatrixTracker",),
    },
)

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
