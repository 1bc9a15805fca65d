"""Controllers proposed from measured responses with bounds."""

from livebode.tuning.predicted import PredictedMargins, disk_margin
from livebode.tuning.proposal import ControllerProposal, tune
from livebode.tuning.specification import LoopSpecification
from livebode.tuning.structure import TunedFeedback

__all__ = [
    "ControllerProposal",
    "LoopSpecification",
    "PredictedMargins",
    "TunedFeedback",
    "disk_margin",
    "tune",
]
