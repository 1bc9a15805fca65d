"""AxisThread: one axis of a session in a thread of its own."""

from __future__ import annotations

import logging
import threading
import time

from livebode.configuration import Axis
from livebode.core import ConfigError, LivebodeError
from livebode.estimates import rule
from livebode.runtime._run import run
from livebode.runtime.estimate import Outcome
from livebode.runtime.recorder import Destination
from livebode.runtime.run_control import RunControl, StoppedError
from livebode.runtime.status import Status

_logger = logging.getLogger(__name__)


class AxisThread:
    """Runs an axis until it ends, is stopped, or fails, without effect on the others.

    Attributes
    ----------
    axis
        Its present configuration.
    control
        Requests to it.
    status
        Its status.
    outcome, error
        Result; one of the two after the end.
    ended_early
        Whether it was stopped before there was anything to record.
    """

    def __init__(self, name: str, axis: Axis, to: Destination, status: Status) -> None:
        self.name, self.axis, self.status = name, axis, status
        self.control = RunControl()
        self.outcome: Outcome | None = None
        self.error: Exception | None = None
        self.ended_early = False
        self._to = to
        # The process does not wait for it: recorded data is safe, and a second signal ends the process at once.
        self._thread = threading.Thread(target=self._work, name=f"livebode axis {name}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    @property
    def alive(self) -> bool:
        return self._thread.is_alive()

    def stands_still(self, longest_s: float) -> bool:
        """Whether it has begun to take samples, and did not look for new ones for this time."""
        looked_s = self.control.looked_s
        return self.alive and looked_s is not None and time.monotonic() - looked_s > longest_s

    def end(self) -> None:
        """Request its end."""
        if self.alive:
            self.status.state = "finishing"
        self.control.end()

    def result(self) -> Outcome:
        """Its result after the end; raises the error with which it failed."""
        if self.outcome is None:
            assert self.error is not None
            raise self.error
        return self.outcome

    def _work(self) -> None:
        name = self.name or "axis"
        _logger.info("%s begins", name)
        try:
            if rule(self.axis.kind, "estimate").alone:
                raise ConfigError(
                    "key-conflict",
                    f"an axis with [{self.axis.kind}] cannot run together with others",
                    "run its recording alone",
                    key=self.axis.kind,
                )
            self.outcome = run(self.axis, self._to, self.control)
        except Exception as error:  # a usage error or an internal error: the other axes continue
            self.error = error
            nothing = isinstance(error, StoppedError) or self.status.directory is None
            self.ended_early = self.control.ended and nothing
            level = logging.INFO if self.ended_early else logging.ERROR
            internal = not isinstance(error, (LivebodeError, StoppedError))
            _logger.log(level, "%s: %s", name, error, exc_info=error if internal else None)
        _logger.info("%s ends", name)
        self.status.state = "done" if self.error is None else "ended" if self.ended_early else "refused"
