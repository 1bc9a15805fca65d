"""Where samples come from: recordings of every usual format, as Blocks."""

from livebode.sources.log import Log
from livebode.sources.opening import open_log
from livebode.sources.recording import Skipped
from livebode.sources.sinumerik import SinumerikSpectra, sinumerik_spectra
from livebode.sources.steps import Gap
from livebode.sources.timing import Timing

__all__ = ["Gap", "Log", "SinumerikSpectra", "Skipped", "Timing", "open_log", "sinumerik_spectra"]
