"""State: the data of one axis in the server, live or from its record."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict
from importlib.metadata import version
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from livebode.analysis import Overview, peak_sensitivity_at_lines
from livebode.configuration import recorded_configuration
from livebode.core import Event, LivebodeError, Quantity, Responses, RunClock
from livebode.dashboard.alarm import AlarmShelf
from livebode.dashboard.alarm_requests import shelving, unshelving
from livebode.dashboard.frames import curve, fits, frame
from livebode.dashboard.hub import Hub, Item
from livebode.dashboard.matrix_group import MatrixGroup
from livebode.dashboard.notices import EventCauses
from livebode.dashboard.overlays import FittedCurve, Healthy, HealthyEntry, grid_hz, overlays_of
from livebode.dashboard.quantities import QUANTITIES, Quantities
from livebode.dashboard.recent import RECORDED_VALUES_MAX, RecentResponses, Trends
from livebode.language import for_page
from livebode.records import RunRecord, to_json
from livebode.runtime import RunControl

_SYMBOLS = {"plant": "G", "open loop": "L", "closed loop": "T", "sensitivity": "S"}
_PACE_S = 3.0
_SILENT_S = 2.0  # or three usual intervals, for sources that send rarely
_BACKLOG_S = 2.0
_GROWS_S = 10.0
_SENT = 90  # responses that were sent in three seconds: one that a person freezes is among them


class State:
    """Newest, recent and thinned responses of an axis, its parameters and events, and the health of its source.

    Used only in the server's thread; data come from a Hub (`refresh`) or from a record (`add`).
    """

    def __init__(self, name: str, axis: int, hub: Hub | None = None) -> None:
        self.name, self.axis, self.hub = name, axis, hub
        self.directory: Path | None = None
        self.group: MatrixGroup | None = None
        """The matrix run of which this is the `entry`; None of any other run."""
        self.entry: str | None = None
        self.quantities: Quantities | None = None
        self.version = self.runs = 0
        self._begun: Mapping[str, Any] | None = None
        self._control: RunControl | None = None  # the same one while runs continue each other
        self._empty()
        self._summary: Mapping[str, Any] = {}
        self._fitted: FittedCurve | None = None
        self._healthy: Healthy | HealthyEntry | None = None
        self._remark = ""
        self._grew = float("-inf")

    def _empty(self) -> None:
        self.newest: Responses | None = None
        self.recent = RecentResponses()
        self._shared = None if self.hub is None else self.hub.overview
        self.overview = self._shared or Overview()
        self.trends, self.notices = Trends(), EventCauses()
        self.first_s = self.last_s = self.start_s = float("nan")
        self.finished = False
        self._seen = 0
        self._pace: deque[tuple[float, int]] = deque(maxlen=128)
        self.sent: deque[Responses] = deque(maxlen=_SENT)
        self._made: dict[tuple[str, Quantity], tuple[int, bytes]] = {}  # frames for all browsers, by version
        self._ending: set[str] = set()  # causes whose unshelving waits to be recorded

    @property
    def live(self) -> bool:
        """Whether a run in this process is active."""
        return self.hub is not None and not self.finished

    @property
    def growing(self) -> bool:
        """Whether another process is recording it: data arrived recently."""
        return self.hub is None and not self.finished and time.monotonic() - self._grew < _GROWS_S

    def read(self) -> None:
        """Mark all data so far as old."""
        self._grew = float("-inf")

    @property
    def readable(self) -> bool:
        """Whether the record can be read: with a journal at any time, without one after the end of the run."""
        return not self.live or "record" in self._summary

    def begin(self, directory: Path, summary: Mapping[str, Any]) -> None:
        """Start a run with its directory and run.json; `runs` counts the runs of the axis."""
        self.runs += 1
        self.directory, self._summary = directory, json.loads(to_json(dict(summary)))  # as it is read back
        if "record" in self._summary:
            self.recent = RecentResponses(RECORDED_VALUES_MAX)
        self.quantities = Quantities.of(self._summary)
        self._fitted, self._healthy, self._remark = overlays_of(self._summary, self.quantities)

    @property
    def summary(self) -> Mapping[str, Any]:
        """The current run.json."""
        return self._summary

    def refresh(self) -> None:
        """Add new data from the hub."""
        hub = self.hub
        if hub is None:
            return
        if hub.begun is not self._begun and hub.begun is not None and hub.directory is not None:
            self._begun, shelves = hub.begun, self.notices.shelves
            continues, self._control = hub.control is self._control, hub.control
            self._empty()
            self.begin(hub.directory, hub.begun)
            self._before()
            if continues:
                self._shelve_again(shelves)
        ended = hub.ended
        self.add(hub.drain())
        if ended is not None and not self.finished:
            self.finished, self._summary = True, json.loads(to_json(dict(ended)))

    def _before(self) -> None:
        """Add the earlier events of a continued run."""
        if "record" not in self._summary or self.directory is None:
            return
        with suppress(LivebodeError):  # it has just started
            self.add(list(RunRecord.open(self.directory, entry=self.entry).events()))

    def _shelve_again(self, shelves: Mapping[str, AlarmShelf]) -> None:
        """Shelve in a run that continues another one what is shelved there."""
        assert self.hub is not None
        for cause, shelf in shelves.items():
            if time.time() < shelf.until_s:
                self.hub.record(shelving(cause, shelf, *self.position))

    def end_shelves(self) -> None:
        """Record the end of shelves whose time has passed."""
        if self.hub is None or self.finished:
            return
        for cause in set(self.notices.expired()) - self._ending:
            if self.hub.record(unshelving(cause, *self.position, self.notices.named(cause))):
                self._ending.add(cause)
        self._ending &= self.notices.shelves.keys()

    @property
    def position(self) -> tuple[int, float]:
        """Sample and time of the newest response; zeros before the first."""
        newest = self.newest
        return (0, 0.0) if newest is None else (int(newest.sample[0]), float(newest.time_s[0]))

    def renewed(self, summary: Mapping[str, Any], finished: bool) -> None:
        """Replace the run.json by the current one."""
        self._summary, self.finished = summary, finished

    def add(self, items: list[Item]) -> None:
        """Add responses, parameters and events in the order of arrival."""
        for item in items:
            if isinstance(item, Responses):
                self._add_responses(item)
            elif isinstance(item, Event):
                self.notices.add(item)
            else:
                self.trends.add_parameters(item)

    def add_past(self, first: Responses, means: Responses, newest: Responses, count: int) -> None:
        """Add a long run: its first responses, means of the whole run, the newest responses, the number of all."""
        self.overview.add(means)
        self._add_times(first)
        self._seen += count - len(newest)
        self._set_newest(newest)

    def _add_responses(self, responses: Responses) -> None:
        if not len(responses):
            return
        if self._shared is None:
            self.overview.add(responses)
        self._set_newest(responses)

    def _set_newest(self, responses: Responses) -> None:
        self._seen += len(responses)
        self._grew = time.monotonic()
        self.recent.add(responses)
        use = np.flatnonzero(responses.valid.any(axis=1))
        row = int(use[-1]) if use.size else len(responses) - 1
        self.newest = responses[row : row + 1]
        self.version += 1
        self._add_times(responses)

    def _add_times(self, responses: Responses) -> None:
        """First windows begin before the recording: their centres are no times at which anything was measured."""
        if not np.isfinite(self.start_s):
            middle = (responses.first[0] + responses.sample[0]) / 2
            self.start_s = float(responses.time_s[0] - middle / responses.lines.rate_hz)
        if not np.isfinite(self.first_s):
            whole = np.flatnonzero((responses.first >= 0) | responses.valid.any(axis=1))
            if not whole.size:
                return
            self.first_s = float(responses.time_s[whole[0]])
        self.last_s = float(responses.time_s[-1])

    def shown(self, quantity: Quantity | None) -> Quantity:
        """The requested quantity if the run permits it, otherwise its own."""
        if self.quantities is None:
            return quantity or "plant"
        return quantity if quantity and not self.quantities.why_not(quantity) else self.quantities.own

    def newest_frames(self, quantity: Quantity) -> bytes:
        """Frames of the newest response and the healthy machine, the same for all browsers."""
        newest = self.newest
        if newest is None:
            return b""
        if not self.sent or self.sent[-1] is not newest:
            self.sent.append(newest)
        return self._once("newest", quantity, self.version, lambda: self._response_frames("newest", newest, quantity))

    def newest_fits(self, quantity: Quantity) -> bytes:
        """Frames of the newest valid fit, its parameters and its model, the same for all browsers."""
        return self._once("fits", quantity, self.trends.version, lambda: self._fit_frames(inf, quantity))

    def frames_at(self, response: Responses, quantity: Quantity) -> bytes:
        """Frames of one response as `moment`, of the healthy machine, and of the nearest valid fit."""
        return self._response_frames("moment", response, quantity) + self._fit_frames(
            float(response.time_s[0]), quantity
        )

    def _once(self, kind: str, quantity: Quantity, version: int, make: Callable[[], bytes]) -> bytes:
        known = self._made.get((kind, quantity))
        if known is None or known[0] != version:
            known = self._made[kind, quantity] = version, make()
        return known[1]

    def _response_frames(self, kind: str, response: Responses, quantity: Quantity) -> bytes:
        assert self.quantities is not None
        made = frame(kind, self.axis, self.quantities.of_responses(response, quantity))
        if self._healthy is None:
            return made
        near = self._healthy.response(response, self._schedule_before(response))
        return (
            made if near is None else made + frame("baseline", self.axis, self.quantities.of_responses(near, quantity))
        )

    def _fit_frames(self, time_s: float, quantity: Quantity) -> bytes:
        """The parameters of a moment, and the model that is drawn of them."""
        model = None if self._fitted is None else self._fitted.model
        moment = self.trends.moment(time_s, model.name if model else "", model.names if model else ())
        made = fits(self.axis, quantity, moment.plain)
        if self._fitted is None or moment.values is None:
            return made
        return made + curve("model", self.axis, quantity, moment.time_s, self._fitted.curve(moment.values, quantity))

    def rows(self, after: int, most: int) -> Responses | None:
        """The recent responses after the first `after`, at most the newest `most`."""
        return self.recent.newest(min(self.recent.count - after, most))

    def _schedule_before(self, response: Responses) -> float:
        recent = self.recent.newest(64)
        if recent is None:
            return float("nan")
        window_s = response.lines.window / response.lines.rate_hz
        before = np.flatnonzero(recent.time_s <= response.time_s[0] - window_s)
        return float(recent.schedule[before[-1]]) if before.size else float("nan")

    def facts(self) -> dict[str, Any]:
        """Facts that the page needs before it draws."""
        facts: dict[str, Any] = {"axis": self.axis, "name": self.name, "live": self.live, "begun": False}
        q = self.quantities
        if q is None:
            return facts
        words = recorded_configuration(dict(self._summary))
        settings = self._summary["found"]
        return facts | {
            "begun": True,
            "directory": str(self.directory),
            "version": version("livebode"),
            "frequency_hz": q.lines.frequency_hz.tolist(),
            "grid_hz": grid_hz(q.lines).tolist(),
            "rate_hz": q.lines.rate_hz,
            "window": q.lines.window,
            "format": settings.get("format", ""),
            "quantity": q.own,
            "quantities": [
                {
                    "name": name,
                    "symbol": _SYMBOLS[name],
                    "unit": q.unit_of(name),
                    "units": q.units_of(name),
                    "drive": q.in_source_units(name),
                    "why_not": for_page(q.why_not(name)),
                }
                for name in QUANTITIES
            ],
            "signals": words.get("signals", {}),
            "schedule": settings.get("schedule") or words.get("signals", {}).get("schedule", ""),
            "model": self._fitted.model.name if self._fitted else "",
            "baseline": self._healthy is not None,
            "remark": for_page(self._remark),
            "matrix": None if self.group is None else self.group.plain(),
        }

    def span(self) -> dict[str, Any]:
        """Span of time with data, and its clock."""
        return {
            "first_s": self.first_s,
            "last_s": self.last_s,
            "live": self.live,
            "growing": self.growing,
            "start_s": self.start_s,
            "clock": self.clock,
        }

    @property
    def clock(self) -> list[tuple[float, float]]:
        """Time of day of the run's seconds, as in `RunClock`; empty if the run has no clock.

        Events before the start of a run have a date.
        """
        if self.quantities is None:
            return RunClock.of_kind("utc").pieces
        if self.hub is not None and self.hub.clock:
            return list(self.hub.clock)
        return RunClock.of(dict(self._summary), self.first_s).pieces

    def health(self) -> dict[str, Any]:
        """Health of source and tracking."""
        now = time.monotonic()
        self._pace.append((now, self._seen))
        while len(self._pace) > 2 and self._pace[0][0] < now - _PACE_S:
            self._pace.popleft()
        (then, before), gone = self._pace[0], self._seen - self._pace[0][1]
        health_facts: dict[str, Any] = {
            "responses": self._seen,
            "responses_per_s": gone / (now - then) if now > then and before >= 0 else None,
            "events": self.notices.counts,
            "ms_at_lines": self._largest_sensitivity(),
        }
        hub = self.hub
        if hub is None:
            return health_facts | {"counts": self._summary.get("counts"), "source": self._summary.get("source")}
        delays = np.array(hub.delays_s) * 1e3
        health_facts |= {"samples": hub.samples, "gaps": hub.gaps, "given_up": hub.given_up}
        silent_s, stale = self.silence()
        health_facts |= {"ending": hub.ending, "silent_s": silent_s, "stale": stale, "backlog_s": self.backlog_s()}
        if delays.size:
            health_facts |= {"behind_ms": float(np.median(delays)), "behind_p99_ms": float(np.quantile(delays, 0.99))}
        if (health := hub.health) is not None:
            health_facts["source"] = asdict(health)
        return health_facts

    def silence(self) -> tuple[float, bool]:
        """How long no samples have arrived, and whether that is longer than usual; not while the run is completed."""
        assert self.hub is not None
        silent_s, usual_s = time.monotonic() - self.hub.followed_s, median([*self.hub.intervals_s, 0.0])
        return silent_s, silent_s > max(_SILENT_S, 3 * usual_s) and not self.hub.ending

    def backlog_s(self) -> float | None:
        """How far tracking is behind the source, if that is more than a person expects."""
        health = None if self.hub is None else self.hub.health
        late = health is not None and health.waiting_s is not None and health.waiting_s > _BACKLOG_S
        return health.waiting_s if health is not None and late else None

    @property
    def has_baseline(self) -> bool:
        """Whether the run is compared with a baseline, also where that cannot be drawn."""
        configured = self._summary.get("configuration", {}).get("monitoring") or {}
        monitoring = self._summary.get("monitoring") or {}
        return self._healthy is not None or bool(configured.get("baseline") or monitoring.get("baseline"))

    @property
    def judged(self) -> bool:
        """Whether anything was compared with the baseline; True during the run, when it is not known."""
        monitoring = self._summary.get("monitoring") or {}
        return "judged_s" not in monitoring or bool(monitoring["judged_s"])

    def _largest_sensitivity(self) -> dict[str, float] | None:
        """The largest |S| at a line, without a model."""
        q = self.quantities
        if q is None or self.newest is None or q.why_not("sensitivity") or q.loop is None or q.loop.feedback is None:
            return None
        plant = q.of_responses(self.newest, "plant")
        value, bound, at_hz = (float(x[0]) for x in peak_sensitivity_at_lines(plant, q.loop))
        return {"value": value, "bound": bound, "frequency_hz": at_hz}
