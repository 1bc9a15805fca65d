"""A frequency response on Matplotlib axes: arrays in, curves and bounds out.

It is below the core, so that `Response.plot` can use it, and knows none of its types; `report` composes its figures
from the same parts. Matplotlib is imported when something is drawn. Text and colours that are not specified here follow
the settings of the caller's Matplotlib.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
