"""Session: several axes, each in a thread; the files that they may open."""

from __future__ import annotations

import logging
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace

from livebode.configuration import Axes, Axis, ConfigurationFile
from livebode.core import ENDING, ConfigError, Event, Handler, LivebodeError, handled
from livebode.language import Message
from livebode.runtime.allocation import FreeMemory, share_between_threads
from livebode.runtime.axis_thread import AxisThread
from livebode.runtime.change import ChangeRequest, change_of
from livebode.runtime.recorder import Destination
from livebode.runtime.service_manager import ServiceManager
from livebode.runtime.status import Status

OPEN_FILES = 1 << 14
"""Enough for 256 axes, each with some files, and for the page."""


def allow_open_files() -> None:
    """Raise the limit of this process, which is often 1,024, as far as the system permits it, up to `OPEN_FILES`."""
    with suppress(ImportError, OSError, ValueError):  # not a POSIX system, or one that does not permit it
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        required = OPEN_FILES if hard == resource.RLIM_INFINITY else min(OPEN_FILES, hard)
        if soft != resource.RLIM_INFINITY and soft < required:
            resource.setrlimit(resource.RLIMIT_NOFILE, (required, hard))


TICK_S = 0.1
LOOK_S = 1.0
"""Interval of checks of the file."""
_logger = logging.getLogger(__name__)


def nothing_to_apply(_: Axes) -> Callable[[], None]:
    """Nothing belongs to the whole session."""
    return lambda: None


class Session:
    """Runs axes until all ended; an axis that fails does not end the others.

    SIGINT and SIGTERM end every axis with complete records; the second one calls `leave`. On SIGHUP or an edit, the
    file is checked completely and then applied or rejected for all axes. Signals are handled in the main thread only.
    A service manager is informed of all this, and its watchdog as long as every axis works.

    Parameters
    ----------
    axes
        Axes by name.
    to
        Destination of an axis, by name and configuration.
    report
        Called with an axis's name and the event of an edit of the file.
    file
        File of `axes`, if they may change.
    leave
        Called at the second signal with its number and a message for each unfinished run; it does not return.
    prepare
        Called with the axes of an edited file: checks what belongs to the whole session, and returns what applies it.
    """

    def __init__(
        self,
        axes: Axes,
        to: Callable[[str, Axis], Destination],
        *,
        report: Callable[[str, Event], None],
        leave: Callable[[int, Mapping[str, Event]], None],
        file: ConfigurationFile | None = None,
        prepare: Callable[[Axes], Callable[[], None]] = nothing_to_apply,
    ) -> None:
        self._prepare = prepare
        self._to, self._report_event, self._leave, self._file = to, report, leave, file
        self.threads: dict[str, AxisThread] = {}
        """The axes of the present configuration, by name."""
        self.taken_out: list[AxisThread] = []
        """Axes that an edit removed."""
        self.ended_by = 0
        """The signal that ended it, or 0."""
        self._reload_asked = threading.Event()
        self._postponed = ""
        self._manager = ServiceManager()
        for name, axis in axes.items():
            self._add(name, axis)

    def run(self, look: Callable[[], None] = lambda: None) -> None:
        """Wait until every axis ended; `look` is called ten times a second, in this thread."""
        share_between_threads()
        allow_open_files()
        memory = FreeMemory()
        with self._hearing():
            for thread in list(self.threads.values()):
                thread.start()
            self._manager.ready()
            looked_s = time.monotonic()
            while any(thread.alive for thread in self.all):
                time.sleep(TICK_S)
                look()
                memory.give_back()
                self._inform()
                asked, now = self._reload_asked.is_set(), time.monotonic()
                if self._file is not None and not self.ended_by and (asked or now - looked_s >= LOOK_S):
                    looked_s = now
                    if asked:
                        self._manager.reloading()
                    self._look_at(self._file, asked)
        self._manager.stopping()

    @property
    def all(self) -> list[AxisThread]:
        """Every axis that was started."""
        return [*self.taken_out, *self.threads.values()]

    def end(self) -> None:
        """End every axis with a complete record."""
        for thread in self.all:
            thread.end()

    def _inform(self) -> None:
        """Inform the service manager; not its watchdog if an axis stands still."""
        if not any(thread.stands_still(self._manager.patience_s) for thread in self.all):
            self._manager.working()
        if self.ended_by:
            self._manager.stopping()
        elif not self._reload_asked.is_set():
            self._manager.ready()

    def _add(self, name: str, axis: Axis, *, replaces: bool = True) -> AxisThread:
        """Start an axis that may replace records from before this session, but none of this session."""
        to = self._to(name, axis)
        status = Status()
        to = replace(to, force=to.force and replaces, subscribers=(status, *to.subscribers))
        self.threads[name] = AxisThread(name, axis, to, status)
        return self.threads[name]

    def _look_at(self, file: ConfigurationFile, asked: bool) -> None:
        if not file.changed() and not asked:
            return
        self._reload_asked.clear()
        try:
            axes = file.read()
            if finishing := self._finishing(axes):
                self._postpone(finishing)
                return
            self._postponed = ""
            changes = self._checked(axes)
            applied = self._prepare(axes)
        except (LivebodeError, MemoryError) as error:
            why = error if str(error) else "there is not enough memory for it"
            self._report_to_axes(
                "configuration-refused",
                Message("configuration rejected: {why}; the previous one stays active", why=why),
            )
            return
        if axes == {name: thread.axis for name, thread in self.threads.items()}:
            if asked:
                self._report_to_axes("configuration-applied", Message("the configuration is the same"), record=False)
            return
        applied()
        self._apply(axes, changes)

    def _finishing(self, axes: Axes) -> str:
        """One of these axes that was removed and whose run is not finished yet."""
        return next((thread.name for thread in self.taken_out if thread.alive and thread.name in axes), "")

    def _postpone(self, name: str) -> None:
        """Check the file again soon: the axis begins when its previous run is finished."""
        self._reload_asked.set()
        if self._postponed != name:
            self._postponed = name
            message = Message(
                "axis {axis} was removed, its run is being finished; the configuration is applied after that", axis=name
            )
            self._report_to_axes("configuration-postponed", message, record=False)

    def _checked(self, axes: Axes) -> dict[str, ChangeRequest | None]:
        """The change for each running axis; LivebodeError if one of them cannot continue with it."""
        changes: dict[str, ChangeRequest | None] = {}
        if ("" in axes) != ("" in self.threads):
            raise ConfigError(
                "change-needs-restart",
                "one axis cannot become several while it runs",
                "stop livebode and start it again",
                keys=["axes"],
            )
        for name, thread in self.threads.items():
            if name not in axes or not thread.alive:
                continue
            try:
                changes[name] = change_of(thread.axis, axes[name], thread.control.source)
            except LivebodeError as error:
                raise (error.at(f"axis {name}") if name else error) from None
        return changes

    def _apply(self, axes: Axes, changes: Mapping[str, ChangeRequest | None]) -> None:
        for name, change in changes.items():
            thread = self.threads[name]
            if change is not None:
                change.request(thread.control)
                thread.axis = axes[name]
                self._publish(name, change.event)
        for name in [name for name in self.threads if name not in axes]:
            self._publish(name, Event("configuration-applied", 0, 0.0, Message("the axis was removed and ends")))
            self.taken_out.append(self.threads.pop(name))
            self.taken_out[-1].end()
        for name, axis in axes.items():
            old = self.threads.get(name)
            if old is None or (not old.alive and old.axis != axis):
                self._publish(name, Event("configuration-applied", 0, 0.0, Message("the axis begins")))
                self._add(name, axis, replaces=False).start()

    def _report_to_axes(self, kind: str, message: str, *, record: bool = True) -> None:
        self._publish("", Event(kind, 0, 0.0, message))
        for thread in self.threads.values() if record else ():
            if thread.alive:
                thread.control.report(kind, message)

    def _publish(self, name: str, event: Event) -> None:
        """Log and publish the result of an edit."""
        level = logging.WARNING if event.kind == "configuration-refused" else logging.INFO
        _logger.log(level, "%s%s", f"axis {name}: " if name else "", event.message)
        self._report_event(name, event)

    @contextmanager
    def _hearing(self) -> Iterator[None]:
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        handlers: dict[signal.Signals, Handler] = dict.fromkeys(ENDING, self._heard)
        if self._file is not None and hasattr(signal, "SIGHUP"):
            handlers[signal.SIGHUP] = lambda *_: self._reload_asked.set()
        with handled(handlers):
            yield

    def _heard(self, number: int, _frame: object) -> None:
        if self.ended_by:
            controls = {thread.name: thread.control for thread in self.all if thread.alive}
            stopped = {name: one.stopped() for name, one in controls.items() if one.stopped is not None}
            self._leave(number, {name: event for name, event in stopped.items() if event is not None})
        self.ended_by = number
        self.end()
