"""The sliding DFT, the stages of lines and of matrices, the verdicts on lines and the fit in C.

Their definitions are the NumPy twins in `tests/twins`, with which tests compare them bit by bit.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
