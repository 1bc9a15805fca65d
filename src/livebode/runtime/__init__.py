"""The run loop: from a source to the record, for one axis or several."""

from livebode.runtime.audience import Audience, Relay
from livebode.runtime.destination import Destination, Draw
from livebode.runtime.following import Outcome
from livebode.runtime.live import run_live
from livebode.runtime.orders import Orders, StoppedError
from livebode.runtime.recording import run
from livebode.runtime.session import Session

__all__ = [
    "Audience",
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
