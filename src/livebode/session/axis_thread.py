"""AxisThread: one axis of a session in a thread of its own."""

from __future__ import annotations

import logging
import threading

from livebode.core import LivebodeError
from livebode.session.axis import Axis
from livebode.session.destination import Destination
from livebode.session.following import Outcome
from livebode.session.live import run_live
from livebode.session.orders import Orders, StoppedError
from livebode.session.recording import run
from livebode.session.status import Status

_logger = logging.getLogger(__name__)


class AxisThread:
    """Runs an axis until it ends, is told to end, or fails, without a consequence for the others.

    Attributes
    ----------
    axis
        Its configuration as it is now.
    orders
        What it is told.
    status
        How it is doing.
    outcome, error
        What it came to; of both one, once it has ended.
    ended_early
        Whether it was told to end before it had anything to leave.
    """

    def __init__(self, name: str, axis: Axis, to: Destination, status: Status) -> None:
        self.name, self.axis, self.status = name, axis, status
        self.orders = Orders()
        self.outcome: Outcome | None = None
        self.error: Exception | None = None
        self.ended_early = False
        self._to = to
        # Not to be waited for at the end of the process: what is recorded is safe, and a second signal means at once.
        self._thread = threading.Thread(target=self._work, name=f"livebode axis {name}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    @property
    def alive(self) -> bool:
        return self._thread.is_alive()

    def end(self) -> None:
        """Tell it to end."""
        if self.alive:
            self.status.state = "finishing"
        self.orders.end()

    def result(self) -> Outcome:
        """What it came to, once it has ended; raises what it failed with."""
        if self.outcome is None:
            assert self.error is not None
            raise self.error
        return self.outcome

    def _work(self) -> None:
        name = self.name or "axis"
        _logger.info("%s begins", name)
        try:
            job = run_live if self.axis.source.live else run
            self.outcome = job(self.axis, self._to, self.orders)
        except Exception as error:  # a sentence for the user, or a fault of ours: the other axes go on
            self.error = error
            nothing = isinstance(error, StoppedError) or self.status.directory is None
            self.ended_early = self.orders.ended and nothing
            level = logging.INFO if self.ended_early else logging.ERROR
            internal = not isinstance(error, (LivebodeError, StoppedError))
            _logger.log(level, "%s: %s", name, error, exc_info=error if internal else None)
        _logger.info("%s ends", name)
        self.status.state = "done" if self.error is None else "ended" if self.ended_early else "refused"
