"""Several inputs and outputs: excitations that separate the inputs, matrices of responses, their modes and changes."""

from typing import TYPE_CHECKING

from livebode.core import REASONS, MatrixResponses
from livebode.on_first_use import on_first_use

if TYPE_CHECKING:
    from livebode.mimo.change import EntryChange, MatrixChange, compare_matrices
    from livebode.mimo.equivalent import equivalent_plant
    from livebode.mimo.example import example_matrix_responses
    from livebode.mimo.excitation import MatrixExcitation
    from livebode.mimo.gantry_change import Cause, GantryChange, compare_gantries
    from livebode.mimo.gantry_fit import GantryFit, fit_gantry
    from livebode.mimo.mean import mean_matrix
    from livebode.mimo.modes import MatrixModes, fit_matrix
    from livebode.mimo.monitor import MatrixMonitor
    from livebode.mimo.prediction import MatrixPrediction, predict, within_limits
    from livebode.mimo.settings import MatrixLoop, MatrixSettings
    from livebode.mimo.tracker import MatrixTracker

__getattr__ = on_first_use(
    __name__,
    {
        "change": ("EntryChange", "MatrixChange", "compare_matrices"),
        "equivalent": ("equivalent_plant",),
        "example": ("example_matrix_responses",),
        "excitation": ("MatrixExcitation",),
        "gantry_change": ("Cause", "GantryChange", "compare_gantries"),
        "gantry_fit": ("GantryFit", "fit_gantry"),
        "mean": ("mean_matrix",),
        "modes": ("MatrixModes", "fit_matrix"),
        "monitor": ("MatrixMonitor",),
        "prediction": ("MatrixPrediction", "predict", "within_limits"),
        "settings": ("MatrixLoop", "MatrixSettings"),
        "tracker": ("MatrixTracker",),
    },
)

__all__ = [
    "REASONS",
    "Cause",
    "EntryChange",
    "GantryChange",
    "GantryFit",
    "MatrixChange",
    "MatrixExcitation",
    "MatrixLoop",
    "MatrixModes",
    "MatrixMonitor",
    "MatrixPrediction",
    "MatrixResponses",
    "MatrixSettings",
    "MatrixTracker",
    "compare_gantries",
    "compare_matrices",
    "equivalent_plant",
    "example_matrix_responses",
    "fit_gantry",
    "fit_matrix",
    "mean_matrix",
    "predict",
    "within_limits",
]
