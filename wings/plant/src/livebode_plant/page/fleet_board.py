"""FleetBoard: the state of all axes of a fleet as a page shows it, with its alarms; without network and browsers."""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any, get_args

import numpy as np

from livebode.core import ServerError
from livebode.dashboard import MINUTES_MAX, NAME_MAX, TEXT_MAX, Act, AlarmRequest, AlarmShelf, AlarmState
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.monitoring import ALARMS
from livebode_plant.fleet.status_message import ACTIVE, BEHIND, NOT_READY, PRIORITIES, SILENT
from livebode_plant.page.fleet_axes import NOWHERE, FleetAxes

CONDITIONS: tuple[AlarmState, ...] = (
    "normal", "unacknowledged", "returned", "acknowledged", "suppressed", "shelved",
)  # fmt: skip
"""The states by their numbers in arrays."""
NORMAL, UNACKNOWLEDGED, RETURNED, ACKNOWLEDGED, SUPPRESSED, SHELVED = range(len(CONDITIONS))
ACT_BYTES_MAX = 4096
_COUNT_MAX = 1 << 32
Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class FleetAct:
    """What a person did with the alarm of an axis: all pages of a fleet get it, and a new one the newest of each axis.

    Attributes
    ----------
    act, path
        What, and the axis.
    raised, raised_s
        How often the alarm had been raised, and when last, by the clock of its worker: those are acknowledged.
    by, words
        Person, and comment or reason.
    until_s, at_s
        End of the shelf, and when the person acted, seconds since 1970.
    """

    act: Act
    path: str
    raised: int
    raised_s: int
    by: str = ""
    words: str = ""
    until_s: float = 0.0
    at_s: float = 0.0

    def to_bytes(self) -> bytes:
        """This act as JSON."""
        return json.dumps(asdict(self), ensure_ascii=False).encode()

    @classmethod
    def of(cls, data: bytes) -> FleetAct | None:
        """The act in these bytes; None if they are none."""
        try:
            if len(data) > ACT_BYTES_MAX:
                return None
            act = cls(**json.loads(data))
        except (ValueError, TypeError, RecursionError):
            return None
        return act if act._valid() else None

    def _valid(self) -> bool:
        texts = ((self.path, ACT_BYTES_MAX), (self.by, NAME_MAX), (self.words, TEXT_MAX))
        times = (self.until_s, self.at_s)
        return (
            self.act in get_args(Act)
            and all(isinstance(text, str) and len(text) <= most and text.isprintable() for text, most in texts)
            and all(type(n) is int and 0 <= n < _COUNT_MAX for n in (self.raised, self.raised_s))
            and all(isinstance(t, int | float) and not isinstance(t, bool) and isfinite(t) for t in times)
            and 0 <= self.until_s <= self.at_s + 60 * MINUTES_MAX + 1
        )


class FleetAlarms:
    """Acknowledgements and shelves of axes by their rows."""

    def __init__(self) -> None:
        self.version = 0
        self._seen = np.zeros(0, np.uint32)
        self._seen_s = np.zeros(0, np.uint32)
        self._until_s = np.zeros(0)
        self._shelves: dict[int, AlarmShelf] = {}
        self._acknowledged: dict[int, FleetAct] = {}

    def apply(self, act: FleetAct, row: int) -> None:
        """Take an act on the axis of a row."""
        self._grow(row + 1)
        self.version += 1
        if act.act == "acknowledge":
            self._seen[row], self._seen_s[row] = act.raised, act.raised_s
            self._acknowledged[row] = act
        elif act.act == "shelve":
            self._until_s[row] = act.until_s
            self._shelves[row] = AlarmShelf(act.by, act.until_s, act.words)
        else:
            self._until_s[row] = 0.0
            self._shelves.pop(row, None)

    def conditions(self, status: Array, kinds: list[str], now_s: float) -> Array:
        """Number in `CONDITIONS` of each row, shape (rows,)."""
        self._grow(len(status))
        raised, active = status["raised"], (status["flags"] & ACTIVE) > 0
        of_response = np.array([kind in ALARMS and ALARMS[kind].of_response for kind in kinds])[status["kind"]]
        # An axis that begins again counts from zero: its next alarm must not pass for an acknowledged one.
        new = (self._seen[: len(status)] < raised) | ((self._seen_s[: len(status)] < status["raised_s"]) & (raised > 0))
        conditions = np.where(new, np.where(active, UNACKNOWLEDGED, RETURNED), np.where(active, ACKNOWLEDGED, NORMAL))
        conditions[active & of_response & ((status["flags"] & NOT_READY) > 0)] = SUPPRESSED
        conditions[(conditions != NORMAL) & (self._until_s[: len(status)] > now_s)] = SHELVED
        return conditions.astype(np.uint8)

    def plain(self, row: int, now_s: float) -> dict[str, Any]:
        """Who acknowledged the alarm of a row, and its shelf, for the page."""
        act, shelf = self._acknowledged.get(row), self._shelves.get(row)
        found: dict[str, Any] = {"by": act.by, "comment": act.words} if act is not None else {"by": "", "comment": ""}
        return found | {"shelf": shelf.plain() if shelf is not None and shelf.until_s > now_s else None}

    def _grow(self, rows: int) -> None:
        if rows > len(self._seen):
            more = max(1024, rows, 2 * len(self._seen)) - len(self._seen)
            self._seen = np.concatenate([self._seen, np.zeros(more, np.uint32)])
            self._seen_s = np.concatenate([self._seen_s, np.zeros(more, np.uint32)])
            self._until_s = np.concatenate([self._until_s, np.zeros(more)])


LOOKS = (
    "open", "ok", "check", "alarm", "returned", "acknowledged", "shelved", "not ready", "silent", "behind", "lost",
)  # fmt: skip
"""How a tile looks, by its number: 4 bits. Lost: its partition has no worker."""
ALARM, RETURNED_LOOK, ACKNOWLEDGED_LOOK, SHELVED_LOOK, NOT_READY_LOOK, SILENT_LOOK, BEHIND_LOOK, LOST = range(3, 11)
_SEVERITY = np.array([1, 0, 6, 10, 7, 5, 2, 3, 9, 8, 4], float)
# A worker that is lost would fill the list of the worst axes with all of its axes; it is in the list of workers.
LOST_S = 5.0
"""A partition whose status is older than this has no worker."""
WORST, ALARMS_MAX, PARTITIONS_MAX = 50, 300, 100
_ACTS_MAX = 1 << 18


class FleetBoard:
    """Takes status messages of any partitions and acts of persons; answers what pages show.

    Axes are numbered in the order of the page. The numbers are valid for one `layout`.
    """

    def __init__(self) -> None:
        self.axes, self.alarms = FleetAxes(), FleetAlarms()
        self._acts: OrderedDict[tuple[str, bool], FleetAct] = OrderedDict()  # of axes that have not been named yet
        self._rows_done = 0
        self._looks = np.zeros(0, np.uint8)
        self._conditions = np.zeros(0, np.uint8)

    @property
    def layout(self) -> int:
        """Changes when the numbers of the axes do."""
        return self.axes.version

    @property
    def paths(self) -> list[str]:
        """Path of each axis, in order."""
        return [self.axes.names[row].path for row in self.axes.order]

    def process(self, messages: Sequence[bytes], now_s: float) -> None:
        """Process messages of partitions that arrived until `now_s`, seconds since 1970."""
        self.axes.process(messages, now_s)
        for row in range(self._rows_done, len(self.axes)):
            for acknowledges in (True, False):
                if (act := self._acts.pop((self.axes.names[row].path, acknowledges), None)) is not None:
                    self.alarms.apply(act, row)
        self._rows_done = len(self.axes)

    def process_act(self, data: bytes) -> None:
        """Process an act that arrived; what is not valid is counted as dropped."""
        act = FleetAct.of(data)
        if act is None:
            self.axes.dropped += 1
        elif (row := self.axes.row(act.path)) is not None:
            self.alarms.apply(act, row)
        else:
            self._acts[act.path, act.act == "acknowledge"] = act
            if len(self._acts) > _ACTS_MAX:
                self._acts.popitem(last=False)

    def refresh(self, now_s: float) -> None:
        """Compute the looks of this moment."""
        status = self.axes.status
        self._conditions = conditions = self.alarms.conditions(status, self.axes.kinds, now_s)
        flags = status["flags"]
        looks = status["state"].copy()
        for which, look in (
            ((flags & NOT_READY) > 0, NOT_READY_LOOK),
            (conditions == SHELVED, SHELVED_LOOK),
            (conditions == ACKNOWLEDGED, ACKNOWLEDGED_LOOK),
            ((flags & BEHIND) > 0, BEHIND_LOOK),
            ((flags & SILENT) > 0, SILENT_LOOK),
            (conditions == RETURNED, RETURNED_LOOK),
            (conditions == UNACKNOWLEDGED, ALARM),
        ):
            looks[which] = look
        lost = [n for n, partition in self.axes.partitions.items() if not now_s - partition.heard_s < LOST_S]
        looks[np.isin(self.axes.partition, [*lost, NOWHERE])] = LOST
        self._looks = looks

    @property
    def looks(self) -> Array:
        """Number in `LOOKS` of each axis at the last refresh, in order."""
        return np.asarray(self._looks[self._shown])

    @property
    def counts(self) -> list[int]:
        """Number of axes of each look."""
        return [int(n) for n in np.bincount(self._looks, minlength=len(LOOKS))]

    def worst(self) -> list[dict[str, Any]]:
        """The 50 axes that most need a person, the worst first."""
        status = self.axes.status[: len(self._looks)]
        score = 1e6 * _SEVERITY[self._looks] + 1e5 * status["priority"]
        score += np.minimum(np.nan_to_num(np.abs(status["change_percent"])), 1e4)
        score += 1e-5 * np.minimum(status["lag_s"], 1e4)
        rows = _largest(score, WORST)
        return [self._plain(int(row)) for row in rows if _SEVERITY[self._looks[row]] > 1]

    def open_alarms(self, now_s: float) -> dict[str, Any]:
        """Alarms that are not normal, the most urgent first, at most 300, and how many there are."""
        conditions = self._conditions
        some = np.flatnonzero(conditions != NORMAL)
        rank = np.array([9, 0, 1, 2, 3, 4])[conditions[some]]
        status = self.axes.status[some]
        order = np.lexsort((-status["raised_s"].astype(float), -status["priority"].astype(int), rank))
        rows = [self._plain(int(row)) | self.alarms.plain(int(row), now_s) for row in some[order[:ALARMS_MAX]]]
        return {"rows": rows, "count": len(some)}

    @property
    def open_count(self) -> int:
        """Number of alarms that are not acknowledged."""
        conditions = self._conditions
        return int(np.count_nonzero((conditions == UNACKNOWLEDGED) | (conditions == RETURNED)))

    def gaps(self) -> dict[str, Any]:
        """The 50 axes that lost most samples, and the sums of the fleet."""
        status = self.axes.status
        worst = _largest(status["lost"].astype(float) + 1e-3 * np.minimum(status["gaps"], 100), WORST)
        rows = [self._plain(int(row)) for row in worst if status["gaps"][row] or status["lost"][row]]
        return {
            "rows": rows,
            "axes": int(np.count_nonzero(status["gaps"])),
            "gaps": int(status["gaps"].sum(dtype=np.uint64)),
            "lost": int(status["lost"].astype(float).sum()),
        }

    def workers(self, now_s: float) -> dict[str, Any]:
        """Each worker with the sums and the worst of its partitions, the latest first; and partitions without one."""
        workers: dict[str, dict[str, Any]] = {}
        silent: list[dict[str, Any]] = []
        for number, partition in sorted(self.axes.partitions.items()):
            age_s = now_s - partition.heard_s
            names = partition.names
            if not age_s < LOST_S:
                silent.append({"partition": number, "axes": len(partition.rows), "age_s": _number(age_s)})
                continue
            name = "" if names is None else names.worker
            worker = workers.setdefault(
                name, {"worker": name, "partitions": 0, "axes": 0, "waiting": 0, "lag_s": 0.0, "age_s": 0.0}
            )
            worker["partitions"] += 1
            worker["axes"] += len(partition.rows)
            worker["waiting"] += partition.waiting
            worker["lag_s"] = max(worker["lag_s"], _number(partition.lag_s))
            worker["age_s"] = max(worker["age_s"], _number(age_s))
        rows = sorted(workers.values(), key=lambda worker: (-worker["lag_s"], -worker["waiting"], worker["worker"]))
        return {
            "rows": rows[:PARTITIONS_MAX], "count": len(rows), "partitions": len(self.axes.partitions),
            "silent": silent[:PARTITIONS_MAX], "silent_count": len(silent),
            "waiting": sum(worker["waiting"] for worker in rows), "dropped": self.axes.dropped,
        }  # fmt: skip

    def axis(self, number: int, now_s: float) -> dict[str, Any] | None:
        """All that is known of an axis; None without one."""
        if not 0 <= number < len(self._looks):
            return None
        row = int(self.axes.order[number])
        name, number = self.axes.names[row], int(self.axes.partition[row])
        partition = self.axes.partitions.get(number)
        worker = "" if partition is None or partition.names is None else partition.names.worker
        about = {"unit": name.unit, "url": name.url, "partition": number, "worker": worker}
        return self._plain(row) | self.alarms.plain(row, now_s) | about

    def act(self, act: Act, asked: AlarmRequest, now_s: float) -> FleetAct:
        """The act that a request asks for; its event is "layout:number of times raised".

        Raises
        ------
        ServerError
            If the page shows another fleet, or the axis has no alarm.
        """
        layout, _, raised = asked.event.partition(":")
        if layout != str(self.layout) or not (raised.isascii() and raised.isdigit() and len(raised) < 11):
            raise ServerError("event-unknown", "the axes of the fleet have changed", "try again", event=asked.event)
        row = int(self.axes.order[asked.axis])
        status = self.axes.status[row]
        count = min(int(raised), int(status["raised"]))
        if count == 0:
            raise ServerError("no-alarm", "this axis has no alarm", Message("reload the page"), event=asked.event)
        until_s = round(now_s + 60 * asked.minutes, 3) if act == "shelve" else 0.0
        path, raised_s = self.axes.names[row].path, int(status["raised_s"])
        return FleetAct(act, path, count, raised_s, asked.by, asked.words, until_s, round(now_s, 3))

    @property
    def _shown(self) -> Array:
        order = self.axes.order
        return order if len(order) == len(self._looks) else order[:0]

    def _plain(self, row: int) -> dict[str, Any]:
        status = self.axes.status[row]
        numbers = ("effective_s", "lag_s", "value", "bound", "change_percent")
        plain: dict[str, Any] = {name: _number(float(status[name])) for name in numbers}
        plain |= {name: int(status[name]) for name in ("lost", "gaps", "raised", "raised_s")}
        return plain | {
            "axis": int(self.axes.place[row]),
            "look": int(self._looks[row]),
            "parameter": self.axes.names[row].parameter,
            "kind": self.axes.kinds[status["kind"]],
            "priority": PRIORITIES[status["priority"]],
            "state": CONDITIONS[self._conditions[row]],
        }


def _largest(score: Array, count: int) -> Array:
    """Places of the largest values, the largest first; of equal ones the first."""
    some = np.argpartition(-score, count)[:count] if len(score) > count else np.arange(len(score))
    return np.asarray(some[np.lexsort((some, -score[some]))])


def _number(value: float) -> float | None:
    """A number for JSON, with the digits that a person reads."""
    if not isfinite(value):
        return None
    return round(value, 3) if abs(value) > 1e6 else float(f"{value:.6g}")
