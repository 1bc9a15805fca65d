"""From samples to frequency responses: the online tracker and the offline reference."""

from livebode.estimation.line_stage import plant_kinds, response_unit
from livebode.estimation.movement import Movement
from livebode.estimation.nonperiodic_tracker import NonPeriodicTracker
from livebode.estimation.ripple import RippleOrder, RippleSpeed, ripple_power
from livebode.estimation.settings import Settings
from livebode.estimation.spectra_tracker import SpectraTracker
from livebode.estimation.stream_estimator import Follower
from livebode.estimation.tracker import Tracker
from livebode.estimation.welch import welch

__all__ = [
    "Follower",
    "Movement",
    "NonPeriodicTracker",
    "RippleOrder",
    "RippleSpeed",
    "Settings",
    "SpectraTracker",
    "Tracker",
    "plant_kinds",
    "response_unit",
    "ripple_power",
    "welch",
]
