"""Doctor: what a person asks first when something does not work, and a bundle for a report (docs/how-to/doctor.md)."""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
