"""From samples to frequency responses: the online tracker and the offline reference."""

from livebode.estimation.settings import Settings
from livebode.estimation.tracker import Tracker, response_unit
from livebode.estimation.welch import welch

__all__ = ["Settings", "Tracker", "response_unit", "welch"]
