"""Controllers proposed from measured responses with bounds."""

from livebode_control.tuning.predicted import PredictedMargins, disk_margin
from livebode_control.tuning.proposal import ControllerProposal, tune
from livebode_control.tuning.specification import LoopSpecification
from livebode_control.tuning.structure import TunedFeedback

__all__ = [
    "ControllerProposal",
    "LoopSpecification",
    "PredictedMargins",
    "TunedFeedback",
    "disk_margin",
    "tune",
]
