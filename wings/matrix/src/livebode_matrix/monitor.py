"""Matrices compared with a baseline, one after the other: alarms that name the entry or the part."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

from livebode.core import Event, FitError, MatrixResponses, Stage, StatefulBase, UsageError, moment
from livebode.dataclass import dataclass
from livebode.fitting import mean_matrix
from livebode.language import Message
from livebode.simulation import Gantry
from livebode_matrix.change import EntryChange, MatrixPair, tail
from livebode_matrix.gantry_change import CART_PLACE, Cause, compare_gantries
from livebode_matrix.gantry_fit import fit_gantry
from livebode_matrix.line_correlation import RowSteps


@dataclass(frozen=True)
class MatrixAlarm:
    """A matrix that chance does not explain.

    Attributes
    ----------
    first, sample, time_s
        First and newest sample and effective time of the matrix.
    probability
        That chance alone gives as large a difference from the baseline.
    entry
        The entry that changed most.
    causes
        Parts of the described machine that changed; none without a description.
    """

    first: int
    sample: int
    time_s: float
    probability: float
    entry: EntryChange
    causes: tuple[Cause, ...]

    @classmethod
    def of(cls, newest: MatrixResponses, pair: MatrixPair, causes: tuple[Cause, ...]) -> MatrixAlarm:
        """The alarm for a matrix of one row, its difference from the baseline, and the causes of that."""
        entry = min(pair.entries(), key=lambda changed: changed.probability)
        return cls(
            max(int(newest.first[0]), 0),
            int(newest.sample[0]),
            float(newest.time_s[0]),
            pair.probability,
            entry,
            causes,
        )

    @property
    def since(self) -> dict[str, Any]:
        """Where the change was first seen."""
        return {"since_s": self.time_s, "since_sample": self.first}

    @property
    def reported(self) -> dict[str, Any]:
        """What a later matrix is compared with: the part, else the line of the entry."""
        if self.causes:
            cause = self.causes[0]
            return {"name": cause.part, "amount": cause.amount, "bound": cause.bound, "frequency_hz": None}
        entry = self.entry
        return {
            "name": _name(entry),
            "amount": entry.share,
            "bound": entry.bound,
            "frequency_hz": entry.frequency_hz,
        }

    def corrects(self, reported: dict[str, Any], pair: MatrixPair) -> bool:
        """Whether it shows another part, or another amount by more than both bounds."""
        if self.causes:
            now = self.reported
            if now["name"] != reported["name"]:
                return True
            amount, bound = now["amount"], now["bound"]
        elif reported["frequency_hz"] is None:
            return False  # The part is known from a better matrix.
        else:
            # At the same line: which entry and line differ most is by chance where several do.
            amount, bound = pair.share(reported["name"], reported["frequency_hz"])
        return bool(abs(amount - reported["amount"]) > bound + reported["bound"])

    def event(self, kind: str, since: dict[str, Any]) -> Event:
        """The change or its correction, first seen there."""
        entry = self.entry
        changes = [_change_of(cause) for cause in self.causes]
        facts = {
            "response": _name(entry),
            "percent": 100 * entry.share,
            "bound": 100 * entry.bound,
            "line_hz": entry.frequency_hz,
        }
        if changes:
            by = Message("the response {response} differs by {percent:.3g} ± {bound:.2g} % at {line_hz:g} Hz", **facts)
        else:
            by = Message(
                "the response {response} differs from the baseline by {percent:.3g} ± {bound:.2g} % at {line_hz:g} Hz",
                **facts,
            )
        changes.append(by)
        message = Message("In the newest matrix {differences}.", differences=changes)
        if kind == "change":
            message = Message("Since {since} {differences}.", since=moment(since["since_s"]), differences=changes)
        details = {
            "what": "matrix",
            "entry": _name(entry),
            "frequency_hz": entry.frequency_hz,
            "amount_percent": 100 * entry.share,
            "bound_percent": 100 * entry.bound,
            "part": self.causes[0].part if self.causes else None,
            "changes": [_change(cause) for cause in self.causes],
            "probability": self.probability,
        }
        return Event(kind, self.sample, self.time_s, message, details | since)


def cleared(newest: MatrixResponses) -> Event:
    """This matrix agrees with the baseline again."""
    time_s = float(newest.time_s[0])
    message = Message("At {time} the responses agree with the baseline again.", time=moment(time_s))
    return Event("change-cleared", int(newest.sample[0]), time_s, message, {"what": "matrix"})


def _change(cause: Cause) -> dict[str, Any]:
    """Plain data of a cause: its size in percent, or in its unit where that is not known, and of a place."""
    share = cause.before > 0 and cause.part != CART_PLACE
    scale, unit = (100 / cause.before, "%") if share else (1.0, cause.unit)
    return {
        "name": cause.part,
        "of": "value",
        "unit": unit,
        "amount": scale * cause.amount,
        "bound": scale * cause.bound,
    }


def _name(entry: EntryChange) -> str:
    return f"{entry.output}/{entry.input}"


def _change_of(cause: Cause) -> Message:
    """The change of a part, whose name has no article; that of the place names the cart."""
    return cause.sentence if cause.part == CART_PLACE else Message("the {change}", change=cause.sentence)


_DAY_S = 86400.0


class MatrixMonitor(StatefulBase):
    """Events of changes, from the matrices of a machine as they are measured.

    Each matrix that shares no window with the one judged before is compared with the mean of the baseline by Wilks' Λ
    over all entries and lines (`compare_matrices`). The limit of its probability is the time of a matrix's windows over
    the interval of false alarms. The event `change` is given once; `change-corrected` where a later matrix shows
    another part or, by more than both bounds, another amount, because the first one may contain windows from before the
    change; `change-cleared` when a matrix is within the limit again, and all are over `noise_samples`: as long as the
    noise is estimated from windows before and after a change it is too large, and hides that change.

    Delay: that of the matrices; a change shows in full when all their windows are after it. Bias: none.

    Parameters
    ----------
    baseline
        Matrices of the healthy machine, with the lines and signals of those to come.
    false_alarm_interval_s
        Mean time between false alarms, 30 days by default.
    description
        The machine, if it is a gantry: an alarm then names the part that changed.
    noise_samples
        Samples before those of a matrix from which its noise is estimated too (`MatrixSettings.noise_samples`).

    Raises
    ------
    UsageError
        If the interval is not above 0, or the matrix is not that of a gantry that is described.
    FitError
        If no matrix of the baseline is valid, or its noise has too few degrees of freedom.

    Examples
    --------
    >>> from livebode_matrix import example_matrix_responses
    >>> responses = example_matrix_responses()
    >>> MatrixMonitor(responses[:2]).process(responses[2:])
    []
    """

    _stage = Stage("matrix-monitor", 1)
    _STATE = ("_judged", "_judged_samples", "_changes", "_cleared", "_agrees_from", "_reported")

    def __init__(
        self,
        baseline: MatrixResponses,
        *,
        false_alarm_interval_s: float = 30 * _DAY_S,
        description: Gantry | None = None,
        noise_samples: int = 0,
    ) -> None:
        if not false_alarm_interval_s > 0:
            raise UsageError(
                "out-of-range",
                f"false_alarm_interval_s={false_alarm_interval_s} is not above 0",
                "specify seconds, for example 30 days: 2592000",
                argument="false_alarm_interval_s",
                value=false_alarm_interval_s,
            )
        self._baseline, self._steps = mean_matrix(baseline), RowSteps.of(baseline)
        self.false_alarm_interval_s, self._description = false_alarm_interval_s, description
        self._check_baseline()
        self._judged, self._judged_samples, self._changes, self._cleared = -1, 0, 0, 0
        self._noise_samples, self._agrees_from = noise_samples, -1
        self._reported: dict[str, Any] = {}

    def _check_baseline(self) -> None:
        """At the start, instead of at the first alarm."""
        dof, outputs = float(self._baseline.dof[0]), len(self._baseline.outputs)
        if not dof > outputs:
            raise FitError(
                "too-few-lines",
                f"the noise of the baseline has {dof:.3g} degrees of freedom, but {outputs} outputs need more",
                "repeat its experiments more often",
                dof=dof,
            )
        tail(0.0, 1, 1, 1, dof)  # SciPy is installed
        if self._description is not None:
            fit_gantry(self._baseline, self._description)

    @property
    def alarmed(self) -> bool:
        """Whether a change is active."""
        return bool(self._reported)

    @property
    def judged_s(self) -> float:
        """Time of the windows of all judged matrices."""
        return self._judged_samples / self._baseline.lines.rate_hz

    def process(self, responses: MatrixResponses) -> list[Event]:
        """Events of these matrices, which follow the previous ones."""
        events = []
        for row in range(len(responses)):
            if self._is_due(responses, row):
                events += self._judge(responses[np.array([row])])
        return events

    def summary(self) -> dict[str, Any]:
        """Judged time, numbers of raised and cleared alarms, and the active one."""
        return {
            "false_alarm_interval_days": self.false_alarm_interval_s / _DAY_S,
            "judged_by": "matrices",
            "judged_s": self.judged_s,
            "changes": self._changes,
            "cleared": self._cleared,
            "standing": [self._reported["name"]] if self._reported else [],
        }

    def _is_due(self, responses: MatrixResponses, row: int) -> bool:
        """Whether this matrix shares no window with the one judged before, and can be compared."""
        if responses.first[row] <= self._judged or not responses.dof[row] > len(responses.outputs):
            return False
        return bool((responses.valid[row] & self._baseline.valid[0]).all(axis=1).any())

    def _judge(self, response: MatrixResponses) -> list[Event]:
        pair = MatrixPair.of(self._baseline, response, self._steps)
        samples, sample = int(response.sample[0] - response.first[0] + 1), int(response.sample[0])
        self._judged, self._judged_samples = sample, self._judged_samples + samples
        if not pair.probability < samples / response.lines.rate_hz / self.false_alarm_interval_s:
            return self._end(response)
        self._agrees_from = -1
        alarm = MatrixAlarm.of(response, pair, self._causes(response))
        if not self.alarmed:
            self._changes += 1
            self._reported = alarm.reported | alarm.since
            return [alarm.event("change", alarm.since)]
        if not alarm.corrects(self._reported, pair):
            return []
        since = {name: self._reported[name] for name in alarm.since}
        self._reported = alarm.reported | since
        return [alarm.event("change-corrected", since)]

    def _end(self, response: MatrixResponses) -> list[Event]:
        if self._agrees_from < 0:
            self._agrees_from = int(response.first[0])
        if not self.alarmed or response.first[0] - self._agrees_from < self._noise_samples:
            return []
        self._reported, self._cleared = {}, self._cleared + 1
        return [cleared(response)]

    def _causes(self, response: MatrixResponses) -> tuple[Cause, ...]:
        if self._description is None:
            return ()
        try:
            return compare_gantries(self._baseline, response, self._description, steps=self._steps).causes
        except FitError:
            return ()  # The noise of one matrix has too few degrees of freedom; the entry is named.

    @property
    def _identity(self) -> str:
        settings = self.false_alarm_interval_s, self._noise_samples, self._description
        return f"{matrix_digest(self._baseline)} {settings!r}"


def matrix_digest(responses: MatrixResponses) -> str:
    """16 hexadecimal digits of the SHA-256 of values, noise and validity, with signals and lines."""
    digest = hashlib.sha256(repr((responses.outputs, responses.inputs, responses.lines)).encode())
    for values in (responses.value, responses.noise, responses.spread, responses.dof, responses.reason):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()[:16]
