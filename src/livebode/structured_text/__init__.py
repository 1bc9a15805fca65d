"""IEC 61131-3 Structured Text: valid names, pieces of text, and the excitation as a function block."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
