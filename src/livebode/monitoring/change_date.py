"""The date of a change, as an interval, from the evidence of windows in order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import moment
from livebode.dataclass import dataclass
from livebode.language import Message

# A random walk of log-likelihood ratios exceeds ln(1/p) with at most p, on each side of the change (Wald).
_UNLIKELY = float(np.log(2 / 0.05))
_RAMPS = (0.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)  # windows in which the change grows linearly; 0 is a step


@dataclass(frozen=True)
class DateRows:
    """Rows of windows: the likeliest first one with the change, and the first and last one that may be it."""

    likeliest: int
    first: int
    last: int


@dataclass(frozen=True)
class ChangeDate:
    """When a change began: the likeliest time, and an interval that contains it with 95 %.

    `earliest_s` is None where the change may have begun before the first window that is known.
    """

    since_sample: int
    since_s: float
    earliest_s: float | None
    latest_s: float

    def plain(self) -> dict[str, Any]:
        """Details of an event."""
        return {
            "since_s": self.since_s,
            "since_sample": self.since_sample,
            "since_earliest_s": self.earliest_s,
            "since_latest_s": self.latest_s,
        }

    @property
    def text(self) -> Message:
        """For a message."""
        if self.earliest_s is None:
            return Message(
                "{likeliest} (at the latest {latest})", likeliest=moment(self.since_s), latest=moment(self.latest_s, 2)
            )
        return Message(
            "{likeliest} (between {earliest} and {latest})",
            likeliest=moment(self.since_s),
            earliest=moment(self.earliest_s, 2),
            latest=moment(self.latest_s, 2),
        )


def date_of(rows: DateRows, time_s: Floats, sample: Sequence[int], *, healthy_before: bool) -> ChangeDate:
    """The times of rows, of windows with these centres and newest samples.

    A change may begin within the window before the first row, where little of it shows; and the removal of slow drift
    lets the last row show a little of the window after it. `healthy_before`: the machine was known to be healthy at the
    first window.
    """
    half_s = float(np.diff(time_s).min(initial=np.inf)) / 2 if len(time_s) > 1 else 0.0
    known = rows.first > 0 or healthy_before
    earliest_s = float(time_s[max(rows.first - 1, 0)]) - half_s if known else None
    likeliest = rows.likeliest
    return ChangeDate(sample[likeliest], float(time_s[likeliest]), earliest_s, float(time_s[rows.last]) + 3 * half_s)


def rows_of(score: Floats, information: Floats, time_s: Floats, scatter: Floats, inflation: float = 1.0) -> DateRows:
    """Where a change of unknown size may have begun, as a step or a ramp.

    The likelihood of a beginning is maximal over the amount and over the length of a ramp. Rows whose logarithm is less
    than ln 40 below the maximum form the interval. Where the windows scatter more about the best model than their
    information tells, because a change far from the baseline is not linear, so is the limit.

    Parameters
    ----------
    score, information
        Of windows in order, of independent components of the change, (rows, components).
    time_s
        Of their centres, (rows,).
    scatter
        Standard deviation of a constant difference of the healthy machine from the baseline, (components,).
    inflation
        Variance of a mean over neighbouring windows, relative to that of independent ones.
    """
    step_s = float(np.diff(time_s).min()) if len(time_s) > 1 else 1.0
    since = (time_s - time_s[:, np.newaxis]) / step_s + 1  # windows since the row of each beginning, inclusive
    total_score, total = score.sum(axis=0), information.sum(axis=0)
    constant = scatter**2 / (1 + scatter**2 * total)
    best, evidence = None, np.full(len(score), -np.inf)
    for length in _RAMPS:
        rise = np.clip(since / max(length, 1.0), 0.0, 1.0) * (since > 0)
        cross, own = rise @ information, rise**2 @ information
        left = rise @ score - cross * constant * total_score
        known = own - cross**2 * constant
        enough = known > np.finfo(float).eps * total
        amount = np.divide(left, known, out=np.zeros_like(left), where=enough)
        gain = (amount * left).sum(axis=1) / 2
        if best is None or gain.max() > evidence.max():
            row = int(gain.argmax())
            best = row, rise[row], amount[row], constant * (total_score - cross[row] * amount[row])
        evidence = np.maximum(evidence, gain)
    assert best is not None
    row, rise, amount, offset = best
    residual = score - information * (offset + rise[:, np.newaxis] * amount)
    known = information > 0
    square = np.where(known, residual**2 / np.where(known, information, 1.0), 0.0)
    scattered = max(_mean(square[part], known[part]) for part in (slice(None, row), slice(row, None)))
    likely = np.flatnonzero(evidence >= evidence.max() - _UNLIKELY * max(1.0, inflation, scattered))
    return DateRows(row, int(likely[0]), int(likely[-1]))


def independent(score: Floats, information: Floats) -> tuple[Floats, Floats]:
    """Score and information of independent components, (rows, components) each, of correlated ones.

    Parameters
    ----------
    score, information
        (rows, components), (rows, components, components).
    """
    _, axes = np.linalg.eigh(information.sum(axis=0))
    return score @ axes, np.einsum("jc,rjk,kc->rc", axes, information, axes)


def _mean(square: Floats, known: NDArray[np.bool_]) -> float:
    return float(square.sum() / max(np.count_nonzero(known), 1))
