"""From responses to models of the machine: physical parameters and rational models, with covariance."""

from livebode.fitting.binned_mean import BinnedMeans, SharedWindows, binned_means, combined
from livebode.fitting.chains import Rigid, TwoMass
from livebode.fitting.common_poles import POLE_MODELS, CommonPoles, fit_common_poles
from livebode.fitting.fitter import Fitter
from livebode.fitting.mean import RunningMean, mean_response
from livebode.fitting.models import MODELS, model_named
from livebode.fitting.once import Fit, best_of, fit, fit_of
from livebode.fitting.physical import EvaluationGrid, Parameter, PhysicalModel
from livebode.fitting.rational import fit_rational
from livebode.fitting.rational_model import Rational, rational_of
from livebode.fitting.recordings import Between, RecordingsMean
from livebode.fitting.three_mass import ThreeMass
from livebode.fitting.together import fit_each, fit_together
from livebode.fitting.unknown_gain import TwoMassGain

__all__ = [
    "MODELS",
    "POLE_MODELS",
    "Between",
    "BinnedMeans",
    "CommonPoles",
    "EvaluationGrid",
    "Fit",
    "Fitter",
    "Parameter",
    "PhysicalModel",
    "Rational",
    "RecordingsMean",
    "Rigid",
    "RunningMean",
    "SharedWindows",
    "ThreeMass",
    "TwoMass",
    "TwoMassGain",
    "best_of",
    "binned_means",
    "combined",
    "fit",
    "fit_common_poles",
    "fit_each",
    "fit_of",
    "fit_rational",
    "fit_together",
    "mean_response",
    "model_named",
    "rational_of",
]
