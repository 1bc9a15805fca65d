"""From responses to what the machine is: physical parameters and rational models, with covariance."""

from livebode.fitting.chains import Rigid, ThreeMass, TwoMass
from livebode.fitting.fitter import Fitter
from livebode.fitting.mean import mean_response
from livebode.fitting.models import MODELS, model_named
from livebode.fitting.once import Fit, fit
from livebode.fitting.physical import Grid, Parameter, PhysicalModel
from livebode.fitting.unknown_gain import TwoMassGain

__all__ = [
    "MODELS",
    "Fit",
    "Fitter",
    "Grid",
    "Parameter",
    "PhysicalModel",
    "Rigid",
    "ThreeMass",
    "TwoMass",
    "TwoMassGain",
    "fit",
    "mean_response",
    "model_named",
]
