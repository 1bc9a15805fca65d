"""Matrices compared with a baseline, one after the other: alarms that name the entry or the part of the machine."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

from livebode.core import Event, FitError, MatrixResponses, Stage, StatefulBase, UsageError
from livebode.fitting import mean_matrix
from livebode.simulation import Gantry
from livebode_matrix.alarm import MatrixAlarm, cleared
from livebode_matrix.change import MatrixPair, tail
from livebode_matrix.gantry_change import Cause, compare_gantries
from livebode_matrix.gantry_fit import fit_gantry
from livebode_matrix.line_correlation import RowSteps

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
        found = []
        for row in range(len(responses)):
            if self._is_due(responses, row):
                found += self._judge(responses[np.array([row])])
        return found

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

    def _judge(self, one: MatrixResponses) -> list[Event]:
        pair = MatrixPair.of(self._baseline, one, self._steps)
        samples, sample = int(one.sample[0] - one.first[0] + 1), int(one.sample[0])
        self._judged, self._judged_samples = sample, self._judged_samples + samples
        if not pair.probability < samples / one.lines.rate_hz / self.false_alarm_interval_s:
            return self._end(one)
        self._agrees_from = -1
        alarm = MatrixAlarm.of(one, pair, self._causes(one))
        if not self.alarmed:
            self._changes += 1
            self._reported = alarm.reported | alarm.since
            return [alarm.event("change", alarm.since)]
        if not alarm.corrects(self._reported, pair):
            return []
        since = {name: self._reported[name] for name in alarm.since}
        self._reported = alarm.reported | since
        return [alarm.event("change-corrected", since)]

    def _end(self, one: MatrixResponses) -> list[Event]:
        if self._agrees_from < 0:
            self._agrees_from = int(one.first[0])
        if not self.alarmed or one.first[0] - self._agrees_from < self._noise_samples:
            return []
        self._reported, self._cleared = {}, self._cleared + 1
        return [cleared(one)]

    def _causes(self, one: MatrixResponses) -> tuple[Cause, ...]:
        if self._description is None:
            return ()
        try:
            return compare_gantries(self._baseline, one, self._description, steps=self._steps).causes
        except FitError:
            return ()  # The noise of one matrix has too few degrees of freedom; the entry is named.

    @property
    def _identity(self) -> str:
        settings = self.false_alarm_interval_s, self._noise_samples, self._description
        return f"{matrix_digest(self._baseline)} {settings!r}"


def matrix_digest(responses: MatrixResponses) -> str:
    """16 hexadecimal digits of the SHA-256 of values, noise and validity, with signals and lines."""
    found = hashlib.sha256(repr((responses.outputs, responses.inputs, responses.lines)).encode())
    for one in (responses.value, responses.noise, responses.spread, responses.dof, responses.reason):
        found.update(np.ascontiguousarray(one).tobytes())
    return found.hexdigest()[:16]
