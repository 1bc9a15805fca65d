"""Matrices compared with a baseline, one after the other: alarms that name the entry or the part of the machine."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from livebode.core import FitError, MatrixResponses, Stage, StatefulBase, UsageError
from livebode.mimo.change import EntryChange, MatrixPair
from livebode.mimo.gantry_change import Cause, compare_gantries
from livebode.mimo.mean import mean_matrix
from livebode.simulation import Gantry

_DAY_S = 86400.0


@dataclass(frozen=True)
class MatrixAlarm:
    """A matrix that chance does not explain, after those that it did.

    Attributes
    ----------
    sample, time_s
        Newest sample and effective time of the matrix.
    probability
        That chance alone gives as large a difference from the baseline.
    entry
        The entry that changed most.
    causes
        Parts of the described machine that changed; none without a description.
    """

    sample: int
    time_s: float
    probability: float
    entry: EntryChange
    causes: tuple[Cause, ...]

    @property
    def sentence(self) -> str:
        """As text."""
        what = " and ".join(cause.sentence for cause in self.causes) or self.entry.sentence
        return f"Since {self.time_s:.1f} s: {what}"


class MatrixMonitor(StatefulBase):
    """Compares matrices with those of a healthy machine, as they are measured.

    Each matrix that shares no window with the one judged before is compared with the mean of the baseline by Wilks' Λ
    over all entries and lines (`compare_matrices`). The limit of its probability is the time of a matrix's windows over
    the interval of false alarms. An alarm is reported once, until a matrix is within the limit again. A monitor that is
    restored from a snapshot continues with the same alarms as one that was not stopped.

    Delay: that of the matrices; a change shows in full when all their windows are after it. Bias: none.

    Parameters
    ----------
    baseline
        Matrices of the healthy machine, with the lines and signals of those to come.
    false_alarm_interval_s
        Mean time between false alarms, 30 days by default.
    description
        The machine, if it is a gantry: an alarm then names the part that changed.

    Raises
    ------
    UsageError, FitError
        If the interval is not above 0, or no matrix of the baseline is valid.

    Examples
    --------
    >>> from livebode.mimo import example_matrix_responses
    >>> responses = example_matrix_responses()
    >>> MatrixMonitor(responses[:2]).process(responses[2:])
    []
    """

    _stage = Stage("matrix-monitor", 1)
    _STATE = ("_judged", "alarmed")

    def __init__(
        self,
        baseline: MatrixResponses,
        *,
        false_alarm_interval_s: float = 30 * _DAY_S,
        description: Gantry | None = None,
    ) -> None:
        if not false_alarm_interval_s > 0:
            raise UsageError(
                "out-of-range",
                f"false_alarm_interval_s={false_alarm_interval_s} is not above 0",
                "specify seconds, for example 30 days: 2592000",
                argument="false_alarm_interval_s",
                value=false_alarm_interval_s,
            )
        self._baseline = mean_matrix(baseline)
        self._interval_s, self._description = false_alarm_interval_s, description
        self._judged = -1
        self.alarmed = False
        """Whether the newest judged matrix differs from the baseline."""

    def process(self, responses: MatrixResponses) -> list[MatrixAlarm]:
        """Alarms that begin in these matrices, which follow the previous ones."""
        found = []
        for row in range(len(responses)):
            if responses.first[row] <= self._judged or not responses.dof[row] > len(responses.outputs):
                continue
            if not (responses.valid[row] & self._baseline.valid[0]).all(axis=1).any():
                continue
            one = responses[np.array([row])]
            pair = MatrixPair.of(self._baseline, one)
            span_s = float(one.sample[0] - one.first[0] + 1) / one.lines.rate_hz
            self._judged = int(one.sample[0])
            differs = pair.probability < span_s / self._interval_s
            if differs and not self.alarmed:
                found.append(self._alarm(one, pair))
            self.alarmed = differs
        return found

    @property
    def _identity(self) -> str:
        b = self._baseline
        content = b"".join(getattr(b, name).tobytes() for name in ("value", "noise", "spread", "dof", "reason"))
        learned = hashlib.sha256(content).hexdigest()
        return repr((b.lines, b.outputs, b.inputs, learned, self._interval_s, self._description))

    def _alarm(self, one: MatrixResponses, pair: MatrixPair) -> MatrixAlarm:
        entry = min(pair.entries(), key=lambda changed: changed.probability)
        causes: tuple[Cause, ...] = ()
        if self._description is not None:
            try:
                causes = compare_gantries(self._baseline, one, self._description).causes
            except FitError:
                causes = ()  # The noise of one matrix has too few degrees of freedom; the entry is named.
        return MatrixAlarm(int(one.sample[0]), float(one.time_s[0]), pair.probability, entry, causes)
