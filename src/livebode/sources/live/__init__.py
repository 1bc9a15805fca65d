"""Live sources: machines that send their samples in batches. docs/how-to/live.md shows how to connect each.

A source of another package (docs/how-to/plugin.md) is a `SourceKind` with a subclass of `LiveSource`. The decoders turn
what a machine sends into batches: frames, lines of JSON, or what the source itself reads.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
