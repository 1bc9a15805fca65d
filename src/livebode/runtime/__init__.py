"""The run loop: from a source to the record, for one axis or several."""

from livebode.runtime.destination import Destination, Draw
from livebode.runtime.documents import Document, Subscriber
from livebode.runtime.output_only import OutputOnlyOutcome, run_output_only
from livebode.runtime.run import run
from livebode.runtime.run_control import RunControl, StoppedError
from livebode.runtime.run_loop import Outcome, RunLoop
from livebode.runtime.session import Session

__all__ = [
    "Destination",
    "Document",
    "Draw",
    "Outcome",
    "OutputOnlyOutcome",
    "RunControl",
    "RunLoop",
    "Session",
    "StoppedError",
    "Subscriber",
    "run",
    "run_output_only",
]
