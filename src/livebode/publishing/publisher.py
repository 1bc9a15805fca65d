"""Publisher: the receivers of a run, and what leaves this computer unencrypted."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from livebode.configuration import Axis, PublishSection
from livebode.core import ConfigError, on_loopback
from livebode.plugins import named
from livebode.publishing.delivery import DeliveryThread
from livebode.publishing.feed import AxisFeed
from livebode.publishing.outbox import Outbox
from livebode.publishing.secrets import address
from livebode.publishing.sink import SinkConnection, open_sink


def exposure(section: PublishSection) -> str | None:
    """A sentence on who else can read the results or the password; None if nobody can. ConfigError as `address`."""
    if not named("sinks")[section.kind].serves:
        return None
    _, host, port, _ = address(section)
    if on_loopback(host):
        return None
    if section.username is None:
        remedy = "" if section.kind == "prometheus" else "set username and password_file, or "
        return f"whoever reaches {host}:{port} can read the results; {remedy}restrict it by a firewall"
    if section.certificate_file is None:
        return f"the password to {host}:{port} is sent unencrypted; set certificate_file and key_file"
    return None


CLOSE_S = 5.0
"""Longest time at the end in which events that wait are sent."""
_logger = logging.getLogger(__name__)


class Publisher:
    """Sends events and results of several axes. Axes with the same [[publish]] section share its receiver.

    Parameters
    ----------
    axes
        The axes by name.
    outbox
        File for events that wait for delivery; it exists only while something waits or a receiver takes events.
    say
        Called with a sentence for people while no run can record it.
    alone
        Name under which the only axis publishes, which has none of its own.

    Raises
    ------
    LivebodeError
        If a section names what cannot be used, such as a missing password file, or a package is missing.
    """

    def __init__(self, axes: Mapping[str, Axis], outbox: Path, say: Callable[[str], None], *, alone: str) -> None:
        self._path, self._say, self._alone = outbox, say, alone
        self._outbox: Outbox | None = None
        self._feeds: dict[str, AxisFeed] = {}
        self._deliveries: dict[str, DeliveryThread] = {}
        self.prepare(axes)()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def subscriber(self, name: str) -> AxisFeed:
        """The subscriber of an axis."""
        return self._feeds[name]

    def prepare(self, axes: Mapping[str, Axis]) -> Callable[[], None]:
        """Check the sections of these axes, and return what applies them; see the class for what it raises."""
        sections = sections_of(axes)
        new = {
            label: open_sink(section)
            for label, section in sections.items()
            if label not in self._deliveries or self._deliveries[label].section != section
        }
        if self._outbox is None and any(section.sent_events for section in sections.values()):
            self._outbox = Outbox(self._path, self._wake)
        return lambda: self._apply(axes, sections, new)

    def findings(self, name: str) -> dict[str, Any]:
        """Entry ``published`` of an axis's run.json; none without receivers."""
        feed = self._feeds[name]
        receivers = feed.receivers
        found = {one.section.label: one.counts(feed.name) for one in receivers if isinstance(one, DeliveryThread)}
        return {"published": found} if found else {}

    def close(self, patience_s: float = CLOSE_S) -> None:
        """Send what waits, for at most so many seconds, and end."""
        if self._outbox is not None:
            self._outbox.flush()
        for delivery in self._deliveries.values():
            delivery.end(patience_s)
        for label, delivery in self._deliveries.items():
            delivery.join()
            if left := sum(delivery.waiting().values()):
                events = "1 event waits" if left == 1 else f"{left} events wait"
                self._say(f"{label}: {events} in {str(self._path)!r}; the next run to the same directory sends them")
        if self._outbox is not None:
            self._outbox.close()

    def _apply(
        self, axes: Mapping[str, Axis], sections: Mapping[str, PublishSection], new: Mapping[str, SinkConnection]
    ) -> None:
        for label in [label for label in self._deliveries if label in new or label not in sections]:
            self._deliveries.pop(label).end(0.0)
        for label, sink in new.items():
            self._deliveries[label] = DeliveryThread(sections[label], sink, self._outbox, self._report)
        for name, axis in axes.items():
            machine = "" if axis.machine is None else axis.machine.path
            feed = self._feeds.setdefault(name, AxisFeed(name or self._alone, machine))
            feed.receivers = tuple(self._deliveries[section.label] for section in axis.publish)
        for delivery in self._deliveries.values():
            delivery.feeds = tuple(feed for name, feed in self._feeds.items() if delivery in feed.receivers)
        for label in new:
            self._deliveries[label].start()
            if (shown := exposure(sections[label])) is not None:
                self._say(f"{label}: {shown}")

    def _wake(self, labels: set[str]) -> None:
        for label, delivery in list(self._deliveries.items()):
            if label in labels:
                delivery.wake()

    def _report(self, feeds: Sequence[AxisFeed], kind: str, message: str, details: dict[str, Any]) -> None:
        """Record it in the run of the first axis that sends there: a hall has one event of it, not one for each."""
        for feed in feeds:
            if (control := feed.control) is not None:
                control.report(kind, message, **details)
                return
        _logger.warning("%s", message)
        self._say(message)


def sections_of(axes: Mapping[str, Axis]) -> dict[str, PublishSection]:
    """The sections of all axes by name, each once; ConfigError if axes have different ones of the same name."""
    found: dict[str, PublishSection] = {}
    for name, axis in axes.items():
        for section in axis.publish:
            if found.setdefault(section.label, section) != section:
                raise ConfigError(
                    "key-conflict",
                    f"the axes have different [[publish]] sections of the name {section.label!r}",
                    'give each a name of its own: name = "…"',
                    key="publish.name",
                    axes=[name],
                )
    return found
