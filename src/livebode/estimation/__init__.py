"""From samples to frequency responses: the online tracker and the offline reference."""

from livebode.estimation.settings import Settings
from livebode.estimation.tracker import Tracker

__all__ = ["Settings", "Tracker"]
