"""PlotKind: the pictures of a frequency response."""

from typing import Literal

PlotKind = Literal["bode", "nyquist", "nichols"]
