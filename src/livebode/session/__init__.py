"""One run of livebode: from a source to the record."""

from livebode.session.audience import Audience, Relay
from livebode.session.axis import Axis
from livebode.session.configuration import Axes, ConfigurationFile
from livebode.session.destination import Destination, Draw
from livebode.session.following import Outcome
from livebode.session.live import run_live
from livebode.session.orders import Orders, StoppedError
from livebode.session.recording import run
from livebode.session.session import Session

__all__ = [
    "Audience",
    "Axes",
    "Axis",
    "ConfigurationFile",
    "Destination",
    "Draw",
    "Orders",
    "Outcome",
    "Relay",
    "Session",
    "StoppedError",
    "run",
    "run_live",
]
