"""Notices: the events of a run as the page shows them, one for each cause, with the state of its alarm."""

from __future__ import annotations

import hashlib
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Iterator
from dataclasses import field
from typing import Any

from livebode.core import Event
from livebode.dashboard.alarm import (
    OPEN,
    AlarmHistory,
    AlarmShelf,
    AlarmState,
    AlarmStatus,
    What,
    limited,
    number_in,
    text_in,
)
from livebode.dataclass import dataclass
from livebode.language import for_page
from livebode.monitoring import ALARMS, FAR, PRIORITIES, RETURNS, SOURCE, UNMONITORED, cause_of
from livebode.records import each_event, event_counts, group_of
from livebode.runtime import ENDED, SUPPRESSED

ACKNOWLEDGED, SHELVED, UNSHELVED = "acknowledged", "shelved", "unshelved"
CAUSES_MAX = 500
_KNOWN_MAX = 4096
_PLAIN_MAX = 4000  # letters of a message


@dataclass
class Notice:
    """The events of one cause in a run.

    Attributes
    ----------
    cause
        Identifier of the common cause.
    id, kind, words
        Of the newest event.
    first_s, last_s
        Times of the first and of the newest event.
    count, seen
        Number of events, and of acknowledged events.
    changed
        Version of the last change.
    alarm
        Of this cause; None if no event of it was an alarm.
    """

    cause: str
    first_s: float
    last_s: float
    id: str = ""
    kind: str = ""
    words: str = ""
    count: int = 0
    seen: int = 0
    changed: int = 0
    kinds: set[str] = field(default_factory=set)
    alarm: AlarmStatus | None = None

    def add(self, event: Event, times: int, key: str) -> None:
        """Add an event, or as many like it."""
        if self.seen >= self.count:
            self.kinds = set()
        self.kinds.add(event.kind)
        self.id = key
        if self.alarm is None or event.kind in ALARMS:  # its end is shown with what has ended
            self.kind, self.words = event.kind, limited(event.words, _PLAIN_MAX)
        self.count += times
        self.last_s = max(self.last_s, event.time_s)

    def plain(self) -> dict[str, Any]:
        """Plain data for the page."""
        names = ("cause", "id", "kind", "first_s", "last_s", "count", "seen")
        message = {"message": str(self.words), "words": for_page(self.words)}
        return {name: getattr(self, name) for name in names} | message | {"kinds": sorted(self.kinds)}


class EventCauses:
    """The causes of a run's events, the newest last, and the states of their alarms.

    Parameters
    ----------
    clock
        Seconds since 1970, for the end of shelves.
    """

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self.version = 0
        self.counts: dict[str, int] = {}
        self.history = AlarmHistory()
        self.shelves: dict[str, AlarmShelf] = {}
        """Shelves by cause; one whose time has passed remains until its end is recorded."""
        self._clock = clock
        self._shown: OrderedDict[str, Notice] = OrderedDict()
        self._known: OrderedDict[str, tuple[str, int]] = OrderedDict()  # cause, and which of its events
        self._forgotten: deque[tuple[int, str]] = deque(maxlen=CAUSES_MAX)
        self._groups: OrderedDict[str, int] = OrderedDict()  # events of a group so far
        self._source_sample: int | None = None  # at which a silent source returned
        self.suppressed_s: float | None = None
        """Time of the run since which the machine is not ready; None if it is ready."""
        self.unmonitored_s: float | None = None
        """Time of the run since which no change would be found, or only of a part; None if it is monitored."""

    @property
    def changed(self) -> set[str]:
        """Names of the active differences from the baseline."""
        alarms = [shown.alarm for shown in self._shown.values() if shown.cause.partition(":")[0] == "change"]
        return {str(alarm.facts.get("what", "machine")) for alarm in alarms if alarm is not None and alarm.active}

    def add(self, event: Event) -> None:
        """Add an event, or an action of a person."""
        self.version += 1
        if event.kind == ACKNOWLEDGED:
            self._acknowledge(event)
        elif event.kind in (SHELVED, UNSHELVED):
            self._shelve(event)
        else:
            for single, times in self._new(event):
                self._add(single, times, event)

    def of(self, key: str) -> tuple[Notice, int] | None:
        """The notice of an event, and the number of the event in it."""
        cause, number = self._known.get(key, ("", 0))
        notice = self._shown.get(cause)
        return None if notice is None else (notice, number)

    def named(self, cause: str) -> Notice | None:
        """The notice of a cause."""
        return self._shown.get(cause)

    def state(self, notice: Notice) -> AlarmState | None:
        """AlarmState of the alarm of a notice; None if it has none."""
        alarm = notice.alarm
        if alarm is None:
            return None
        if self.shelf(notice.cause) is not None:
            return "shelved"
        if self.suppressed_s is not None and alarm.active and alarm.kind.of_response:
            return "suppressed"
        return alarm.condition(notice.seen)

    def shelf(self, cause: str) -> AlarmShelf | None:
        """The shelf of a cause until its time has passed."""
        shelf = self.shelves.get(cause)
        return shelf if shelf is not None and self._clock() < shelf.until_s else None

    def expired(self) -> list[str]:
        """Causes whose shelf has ended by itself, until that is recorded."""
        return [cause for cause in self.shelves if self.shelf(cause) is None]

    def alarms(self) -> Iterator[tuple[Notice, AlarmStatus, AlarmState]]:
        """Every alarm that is not normal, with its state."""
        for notice in self._shown.values():
            if notice.alarm is not None and (state := self.state(notice)) not in (None, "normal"):
                assert state is not None
                yield notice, notice.alarm, state

    def since(self, version: int) -> list[dict[str, Any]]:
        """Notices that are new or changed after `version`, oldest first."""
        return [self._plain(notice) for notice in self._shown.values() if notice.changed > version]

    def forgotten(self, version: int) -> list[str]:
        """Causes that were forgotten after `version`."""
        return [cause for number, cause in self._forgotten if number > version]

    def _plain(self, notice: Notice) -> dict[str, Any]:
        if notice.alarm is None:
            return notice.plain() | {"alarm": None}
        shelf = self.shelf(notice.cause)
        alarm = notice.alarm.plain() | {"state": self.state(notice), "shelf": shelf and shelf.plain()}
        return notice.plain() | {"alarm": alarm}

    def _new(self, event: Event) -> list[tuple[Event, int]]:
        """The events of a line that were not taken yet, each with how many like it there were."""
        group = group_of(event)
        if group is None:
            return [] if event_id(event) in self._known else [(event, 1)]
        name, count = group
        new = count - self._groups.get(name, 0)
        if new <= 0:
            return []
        self._groups[name] = count
        self._groups.move_to_end(name)
        if len(self._groups) > _KNOWN_MAX:
            self._groups.popitem(last=False)
        each = list(each_event(event))
        counted = event_counts(event)
        counted.subtract(line.kind for line in each)
        events, left = [(line, 1) for line in each[-new:]], new - len(each)
        for kind, number in counted.items():
            if (times := min(number, left)) > 0:
                events.insert(0, (Event(kind, event.sample, event.time_s, event.message, {}), times))
                left -= times
        if left > 0:  # of lines that never arrived
            events[-1] = events[-1][0], 1 + left
        return events

    def _add(self, event: Event, times: int, line: Event) -> None:
        cause = self._cause(event, line)
        notice = self._shown.get(cause)
        if notice is None:
            first_s = number_in(line, "first_s")
            began_s = event.time_s if first_s is None else first_s
            notice = self._shown[cause] = Notice(cause, began_s, event.time_s)
        key = event_id(line, cause)
        notice.add(event, times, key)
        self.counts[event.kind] = self.counts.get(event.kind, 0) + times
        self._judge(notice, event, times)
        self._touch(notice)
        for name in (key, event_id(line)):
            self._known[name] = cause, notice.count
        self._limit()

    def _cause(self, event: Event, line: Event) -> str:
        """Cause of an event; what is lost while the source is silent belongs to the silence."""
        group = {name: line.details[name] for name in ("group", "count") if name in line.details}
        cause = cause_of(Event(event.kind, event.sample, event.time_s, "", event.details | group))
        if event.kind in ("loss", "gap", "overflow", "restart") and SOURCE in self._shown:
            missing = event.details.get("missing_samples", 0)
            began = event.sample - (missing if isinstance(missing, int) else 0)
            silent = (alarm := self._shown[SOURCE].alarm) is not None and alarm.active
            if silent or (self._source_sample is not None and began <= self._source_sample):
                return SOURCE
        return cause

    def _judge(self, notice: Notice, event: Event, times: int) -> None:
        """The state of the alarm after an event of its cause."""
        if event.kind in UNMONITORED:
            self.unmonitored_s = number_in(event, "since_s")  # not in the one that reports the end
        if (kind := ALARMS.get(event.kind)) is not None:
            self._raise(notice, event, times)
            if notice.cause.startswith("change: ") and notice.cause != FAR and FAR in self._shown:
                self._return(self._shown[FAR], event)
            if kind.cause == SOURCE:
                self._source_sample = None
        elif event.kind in RETURNS:
            self._return(notice, event)
        elif event.kind in (SUPPRESSED, ENDED):
            self._suppress(event)

    def _suppress(self, event: Event) -> None:
        """Suppress the alarms of the response, or no longer."""
        since_s = number_in(event, "since_s")
        begins = event.kind == SUPPRESSED
        self.suppressed_s = (event.time_s if since_s is None else since_s) if begins else None
        for notice in self._shown.values():
            alarm = notice.alarm
            if alarm is None or not (alarm.active and alarm.kind.of_response):
                continue
            if not alarm.suppressions:  # a drive that is switched off in each cycle would fill the history
                self._log(notice, "suppressed" if begins else "unsuppressed", event)
            alarm.suppressions += not begins
            self._touch(notice, newest=False)

    def _raise(self, notice: Notice, event: Event, times: int) -> None:
        kind = ALARMS[event.kind]
        if notice.alarm is None:
            notice.alarm = AlarmStatus(kind)
        alarm = notice.alarm
        if notice.cause == SOURCE and kind.cause != SOURCE:
            return  # it follows from the silence, which is announced
        before = alarm.active
        alarm.raise_by(event, kind, times, notice.count)
        if not before or event.kind != "change-corrected":
            self._log(notice, "raised", event, times)

    def _return(self, notice: Notice, event: Event) -> None:
        alarm = notice.alarm
        if alarm is not None and alarm.active:
            alarm.end_at(event.time_s)
            if notice.cause == SOURCE:
                self._source_sample = event.sample
            self._log(notice, "returned", event)
            self._touch(notice)

    def _acknowledge(self, event: Event) -> None:
        noticed = self.of(str(event.details.get("event")))
        notice = self._shown.get(str(event.details.get("cause"))) if noticed is None else noticed[0]
        if notice is None:
            return
        count, alarm = event.details.get("count"), notice.alarm
        open_before = alarm is not None and alarm.condition(notice.seen) in OPEN
        seen = max(notice.seen, count) if isinstance(count, int) else notice.seen
        notice.seen = min(seen, notice.count)
        if alarm is not None and open_before and notice.seen >= alarm.raised:
            alarm.acknowledge(event)
            self._log(notice, "acknowledged", event)
        self._touch(notice, newest=False)

    def _shelve(self, event: Event) -> None:
        cause, until_s = str(event.details.get("cause")), number_in(event, "until_s")
        if event.kind == UNSHELVED:
            self.shelves.pop(cause, None)
        elif until_s is not None and len(self.shelves) < CAUSES_MAX:
            self.shelves[cause] = AlarmShelf(text_in(event, "by"), until_s, text_in(event, "reason"))
        if (notice := self._shown.get(cause)) is not None:
            self._log(notice, "shelved" if event.kind == SHELVED else "unshelved", event)
            self._touch(notice, newest=False)

    def _log(self, notice: Notice, change: What, event: Event, times: int = 1) -> None:
        alarm = notice.alarm
        chatters = alarm is not None and change in ("raised", "returned") and alarm.chatters_at(event.time_s)
        acted = change not in ("raised", "returned")
        facts = {
            "cause": notice.cause,
            "kind": notice.kind if acted else event.kind,
            "words": notice.words if acted else event.words,
            "state": self.state(notice) or "",
            "by": text_in(event, "by"),
            "comment": text_in(event, "comment") or text_in(event, "reason"),
            "count": times,
        }
        self.history.add(self.version, change, event.time_s, chatters=chatters, **facts)

    def _touch(self, notice: Notice, *, newest: bool = True) -> None:
        notice.changed = self.version
        if newest:
            self._shown.move_to_end(notice.cause)

    def _importance(self, cause: str) -> int:
        notice = self._shown[cause]
        if notice.alarm is None or self.state(notice) == "normal":
            return 0
        return 3 - PRIORITIES.index(notice.alarm.kind.priority)

    def _limit(self) -> None:
        """Forget the oldest causes, first those that need nothing, then those of low priority."""
        while len(self._shown) > CAUSES_MAX:
            cause = min(self._shown, key=self._importance)
            del self._shown[cause]
            self._forgotten.append((self.version, cause))
        while len(self._known) > _KNOWN_MAX:
            self._known.popitem(last=False)


def event_id(event: Event, cause: str = "") -> str:
    """A name of an event that is the same whenever the record is read; in a group, of it and all earlier ones.

    `cause` distinguishes the causes of a line with events of several.
    """
    group = group_of(event)
    if group is None:
        text = f"{event.kind}\0{event.sample}\0{event.time_s!r}\0{event.message}"
    else:
        text = f"{group}" if cause in ("", group[0].partition("@")[0]) else f"{group}\0{cause}"
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]
