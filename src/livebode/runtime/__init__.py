"""The run loop: from a source to the record, for one axis or several."""

from typing import TYPE_CHECKING

from livebode.on_first_use import on_first_use
from livebode.runtime.destination import Destination, Draw
from livebode.runtime.documents import Document, Subscriber
from livebode.runtime.run import run
from livebode.runtime.run_control import RunControl, StoppedError
from livebode.runtime.run_loop import Outcome, RunLoop

if TYPE_CHECKING:
    from livebode.runtime.output_only import OutputOnlyOutcome, run_output_only
    from livebode.runtime.session import Session

# What a run of one recording does without.
__getattr__ = on_first_use(__name__, {"output_only": ("OutputOnlyOutcome", "run_output_only"), "session": ("Session",)})

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
