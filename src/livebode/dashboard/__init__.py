"""The page that shows a run while it is recorded, and afterwards (docs/how-to/dashboard.md)."""

from livebode.dashboard.dashboard import Dashboard
from livebode.dashboard.hub import Hub
from livebode.dashboard.settings import Serving

__all__ = ["Dashboard", "Hub", "Serving"]
