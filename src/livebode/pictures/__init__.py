"""The pictures of a run: Bode plot and tracking as PNG, and a Bode plot for the terminal.

The import is cheap: Matplotlib is loaded when the first picture is drawn.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
