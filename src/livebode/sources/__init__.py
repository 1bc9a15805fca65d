"""Where samples come from: recordings of every usual format, as Blocks.

A reader of another package (docs/how-to/plugin.md) is a `Format` with a subclass of `Recording`, or of
`DelimitedRecording` for a text table; its errors are `damaged`, `truncated`, `oversized` and `missing`.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
