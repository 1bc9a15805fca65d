"""Comparison of two runs line by line: mean responses, their ratio, and the lines that differ."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np
from numpy.typing import NDArray

from livebode.analysis import RunMean, averaged
from livebode.arrays import Floats
from livebode.configuration import TrackingSection, recorded_configuration
from livebode.core import PER_LINE, GridError, Lines, Response, Responses, same_frequencies, same_rate, widened
from livebode.dataclass import dataclass
from livebode.fitting import RunningMean
from livebode.language import Message
from livebode.records import RunRecord

ALPHA = 0.05
"""Probability that two runs of an unchanged machine differ at any line."""
_PLACES = 12
_ALONG = 1.645 / 2**0.5  # sigma of a complex value covers both parts; one part is below this with 95 %
_WINDOWS_MIN = 3.0  # non-overlapping windows at a place; fewer give no usable scatter
_SPEEDS_APART = 0.2


@dataclass(frozen=True, eq=False)
class Difference:
    """Changes at the lines that both runs have.

    |G₂ − G₁|²/σ², with σ² = σ₂² + max(1, |G₂/G₁|²)·σ₁², follows F(2, 2d) if nothing changed (d by Welch and
    Satterthwaite), so that p = (1 + |G₂ − G₁|²/(σ²·d))^−d. A line differs if p < α/m for m lines (Bonferroni), that is,
    if the bound of the ratio does not cover 1. The probability of a false claim at any line is at most α = 5 %.

    Attributes
    ----------
    before, after
        The mean responses at the common lines; over the common places if both runs have a schedule.
    ratio, bound
        G₂/G₁ and the radius of its bound, which covers all lines together with 95 %, (lines,).
    p
        (lines,).
    seen
        The smallest relative change at each line that is detected with a probability of 95 %, (lines,).
    m
        Number of lines that are tested together.
    ignore_below
        Smallest |G₂/G₁ − 1| that matters: a line that differs by less is not listed.
    """

    before: Response
    after: Response
    ratio: NDArray[np.complex128]
    bound: Floats
    p: Floats
    seen: Floats
    m: int
    ignore_below: float = 0.0

    @property
    def differs(self) -> NDArray[np.bool_]:
        """Mask of the lines that differ, and by an amount that matters, (lines,)."""
        return np.asarray(self._significant & (np.abs(self.ratio - 1) >= self.ignore_below))

    @property
    def ignored(self) -> NDArray[np.bool_]:
        """Mask of the lines that differ by less than matters, (lines,)."""
        return np.asarray(self._significant & ~self.differs)

    @property
    def _significant(self) -> NDArray[np.bool_]:
        return np.asarray(self.p < ALPHA / self.m)

    @classmethod
    def of(
        cls,
        before: Response,
        after: Response,
        m: int | None = None,
        *,
        ignore_below: float = 0.0,
        together: int = 1,
    ) -> Difference:
        """The difference of two mean responses on the same lines.

        Parameters
        ----------
        before, after
            The mean responses.
        m
            Number of lines that are tested together; default: those of these responses, times `together`.
        ignore_below
            Smallest change that matters.
        together
            Number of pairs of responses with so many lines that are tested together.
        """
        known = before.valid & after.valid & np.isfinite(before.sigma) & np.isfinite(after.sigma)
        m = m or together * max(int(np.count_nonzero(known)), 1)
        with np.errstate(all="ignore"):
            ratio = np.where(known, after.value / before.value, np.nan)
            first, second = (np.maximum(1, np.abs(ratio)) * before.sigma) ** 2, after.sigma**2
            variance = first + second
            dof = variance**2 / (first**2 / before.dof + second**2 / after.dof)
            away = np.abs(after.value - before.value) ** 2 / variance
            p = np.where(known, np.where(np.isinf(dof), np.exp(-away), (1 + away / dof) ** -dof), np.nan)
            sigma = np.sqrt(variance) / np.abs(before.value)
            bound = np.where(known, widened(sigma, dof, float(np.sqrt(log(m / ALPHA)))), np.nan)
        return cls(before, after, ratio, bound, np.asarray(p), bound + _ALONG * sigma, m, ignore_below)


@dataclass(frozen=True, eq=False)
class PlaceDifference:
    """The difference at a place of both runs: an interval of the schedule, forward (rising) or return."""

    low: float
    high: float
    back: bool
    difference: Difference


@dataclass(frozen=True, eq=False)
class RunDifferences:
    """Two runs and their differences, over all and by place, with warnings.

    Attributes
    ----------
    runs, averages
        Before and after.
    overall
        Difference of the means; with a schedule, of the means over the common places with equal weights.
    places
        Differences by place and direction, tested together; empty without a schedule in both runs.
    warnings
        Reasons why the comparison is weaker than it seems, in sentences.
    """

    runs: tuple[RunRecord, RunRecord]
    averages: tuple[RunMean, RunMean]
    overall: Difference
    places: tuple[PlaceDifference, ...]
    warnings: tuple[str, ...]


def compare(before: RunRecord, after: RunRecord, *, ignore_below: float = 0.0, together: int = 1) -> RunDifferences:
    """Compare two runs; lines whose |G₂/G₁ − 1| is less than `ignore_below` do not count as different.

    Entries of a matrix that are tested `together` have no schedule, and so no places.

    Raises
    ------
    GridError
        If quantity or unit differ, or the runs have no common line.
    SignalError
        If a run has no valid response.
    """
    _refuse(before, after)
    both = averaged(before), averaged(after)
    common, indices = _common(before.lines, after.lines)
    warnings = _about(before, after, len(common))
    means: list[dict[tuple[int, bool], Responses]] = []
    span = (max(a.spans[0] for a in both), min(a.spans[1] for a in both))
    if all(a.moved for a in both) and not any(_averages(run) for run in (before, after)):
        warnings += _overlap(both, span)
        if span[1] > span[0]:
            means = [_by_place(run, span) for run in (before, after)]
    elif any(a.moved for a in both):
        warnings.append(
            Message(
                "Only one of the runs has a changing schedule: differences may be due to the position, not the machine."
            )
        )
    shared = sorted(means[0].keys() & means[1].keys()) if means else []
    if not shared:
        first, other = (_on(a.response, common, i) for a, i in zip(both, indices))
        difference = Difference.of(first, other, ignore_below=ignore_below, together=together)
        return RunDifferences((before, after), both, difference, (), tuple(warnings))
    pairs = [tuple(_on(m[key][0], common, i) for m, i in zip(means, indices)) for key in shared]
    known = [_known(a) & _known(b) for a, b in pairs]
    m = max(int(np.sum(known)), 1)
    edges = np.linspace(*span, _PLACES + 1)
    places = tuple(
        PlaceDifference(float(edges[i]), float(edges[i + 1]), back, Difference.of(a, b, m, ignore_below=ignore_below))
        for (i, back), (a, b) in zip(shared, pairs)
    )
    joined = [_together([pair[i] for pair in pairs], np.array(known)) for i in (0, 1)]
    overall = Difference.of(joined[0], joined[1], ignore_below=ignore_below)
    return RunDifferences((before, after), both, overall, places, tuple(warnings))


def _refuse(before: RunRecord, after: RunRecord) -> None:
    for attribute in ("quantity", "unit"):
        first, other = (run.found.get(attribute, "") for run in (before, after))
        if first != other:
            raise GridError(
                "not-alike",
                f"{before.path.name!r} has the {attribute} {first!r} and {after.path.name!r} {other!r}: such responses "
                "cannot be compared",
                f"compare runs of the same {attribute}",
                what=attribute,
                values=[first, other],
            )


def _common(before: Lines, after: Lines) -> tuple[Lines, tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """The common lines on the grid of the first run, and their indices in both runs."""
    f, g = before.frequency_hz, after.frequency_hz
    nearest = np.abs(f[:, np.newaxis] - g).argmin(axis=1)
    spacing_hz = min(before.resolution_hz, after.resolution_hz)
    first = np.flatnonzero(same_frequencies(f, g[nearest], spacing_hz))
    if not first.size:
        raise GridError(
            "no-common-line",
            f"the runs have no line in common: {f[0]:g} … {f[-1]:g} Hz on a grid of {before.resolution_hz:g} Hz, and "
            f"{g[0]:g} … {g[-1]:g} Hz on one of {after.resolution_hz:g} Hz",
            "track one again at the other's lines",
            resolutions_hz=[before.resolution_hz, after.resolution_hz],
        )
    bins = tuple(before.bins[i] for i in first)
    return Lines(bins, before.window, before.rate_hz), (first, nearest[first])


def _about(before: RunRecord, after: RunRecord, common: int) -> list[str]:
    """Warnings about settings that make the responses of an unchanged machine differ."""
    words: list[str] = []
    if common < max(len(before.lines), len(after.lines)):
        words.append(
            Message(
                "The runs have {common} of {before} and {after} lines in common; these are compared.",
                common=common,
                before=len(before.lines),
                after=len(after.lines),
            )
        )
    first, other = (recorded_configuration(run.summary).get("tracking", {}) for run in (before, after))
    for key, setting in (
        ("estimator", Message("estimators")), ("hann", Message("windows")), ("differenced", Message("differencing"))
    ):  # fmt: skip
        usual = getattr(TrackingSection(), key)
        if (a := first.get(key, usual)) != (b := other.get(key, usual)):
            words.append(
                Message(
                    "Different {what} ({before} and {after}) may cause differences.", what=setting, before=a, after=b
                )
            )
    if not same_rate(before.lines.rate_hz, after.lines.rate_hz):
        words.append(
            Message(
                "The rates differ ({before_hz:g} and {after_hz:g} Hz), so the delay of the hold, which every "
                "response contains, differs too.",
                before_hz=before.lines.rate_hz,
                after_hz=after.lines.rate_hz,
            )
        )
    if ("motion" in before.found) != ("motion" in after.found):
        words.append(Message("Only one of the runs is corrected for the axis's motion."))
    return words


def _averages(run: RunRecord) -> bool:
    return bool(run.summary.get("configuration", {}).get("tracking", {}).get("average"))


def _overlap(both: tuple[RunMean, RunMean], span: tuple[float, float]) -> list[str]:
    spans = Message.conjunction(Message("{low:.4g} … {high:.4g}", low=a.spans[0], high=a.spans[1]) for a in both)
    if span[1] <= span[0]:
        return [
            Message(
                "The runs have no place in common ({spans} of the schedule): differences may be due to the position.",
                spans=spans,
            )
        ]
    remarks = list[str]()
    if span[1] - span[0] < 0.9 * max(a.spans[1] - a.spans[0] for a in both):
        remarks.append(
            Message(
                "The runs cover different ranges ({spans} of the schedule); only the common part is compared.",
                spans=spans,
            )
        )
    speeds = [_speeds(a.overview) for a in both]
    fast = [float(np.median(s)) if s.size else 0.0 for s in speeds]
    if max(fast) > (1 + _SPEEDS_APART) * min(fast):
        remarks.append(
            Message(
                "The runs have different speeds (median {before:.3g} and {after:.3g} per second), and a response in "
                "motion depends on the speed: differences may be due to it.",
                before=fast[0],
                after=fast[1],
            )
        )
    return remarks


def _speeds(of: Responses) -> Floats:
    with np.errstate(all="ignore"):
        speed = np.abs(np.diff(of.schedule) / np.diff(of.time_s))
    speed = speed[np.isfinite(speed)]
    return np.asarray(speed[speed > 0.1 * np.max(speed, initial=0.0)])


def _by_place(run: RunRecord, span: tuple[float, float]) -> dict[tuple[int, bool], Responses]:
    """The mean at each place of the span, forward and return, without those that have too few windows."""
    edges = np.linspace(*span, _PLACES + 1)
    means: dict[tuple[int, bool], RunningMean] = {}
    hop = int(run.found.get("hop", run.lines.window))
    for part in run.steady_batches():
        x = part.schedule
        inside = np.isfinite(x) & (x >= span[0]) & (x <= span[1])
        place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, _PLACES - 1)
        back = np.gradient(x) < 0 if len(x) > 1 else np.zeros(len(x), dtype=bool)
        for i in range(_PLACES):
            for direction in (False, True):
                rows = np.flatnonzero(inside & (place == i) & (back == direction))
                if rows.size:
                    means.setdefault((i, direction), RunningMean()).add(part[rows])
    share = min(1.0, hop / run.lines.window)
    return {key: mean.response() for key, mean in means.items() if mean.rows * share >= _WINDOWS_MIN}


def _on(response: Response, lines: Lines, indices: NDArray[np.intp]) -> Response:
    """The response at some of its lines."""
    rows = {name: getattr(response, name)[indices] for name in PER_LINE}
    return replace(response, lines=lines, **rows)


def _known(response: Response) -> NDArray[np.bool_]:
    return np.asarray(response.valid & np.isfinite(response.sigma))


def _together(parts: list[Response], known: NDArray[np.bool_]) -> Response:
    """The mean over places with equal weights; at each line only over places where both runs have a known value."""
    n = np.count_nonzero(known, axis=0)
    value, sigma = (np.array([getattr(part, name) for part in parts]) for name in ("value", "sigma"))
    dof = np.array([part.dof for part in parts])[:, np.newaxis]
    with np.errstate(all="ignore"):
        variance = np.where(known, sigma**2, 0.0)
        mean = np.where(known, value, 0).sum(axis=0) / n
        total = variance.sum(axis=0)
        of_line = total**2 / (variance**2 / dof).sum(axis=0)
    finite = of_line[np.isfinite(of_line)]
    return replace(
        parts[0],
        value=mean,
        sigma=np.sqrt(total) / n,
        dof=float(finite.min()) if finite.size else float("inf"),
        valid=n > 0,
        coherence=np.full(len(n), np.nan),
        schedule=float(np.mean([part.schedule for part in parts])),
    )
