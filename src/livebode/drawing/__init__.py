"""A frequency response on Matplotlib axes: arrays in, curves and bounds out.

It is below the core, so that `Response.plot` can use it, and knows none of its types; `report` composes its figures
from the same parts. Matplotlib is imported when something is drawn. Text and colours that are not specified here follow
the settings of the caller's Matplotlib.
"""

from livebode.drawing._curve import Cloud, Curve
from livebode.drawing._curves import SPAN, bound_db, bound_deg, circular, decibels, near, quantiles, unwrapped

__all__ = [
    "SPAN",
    "Cloud",
    "Curve",
    "bound_db",
    "bound_deg",
    "circular",
    "decibels",
    "near",
    "quantiles",
    "unwrapped",
]
