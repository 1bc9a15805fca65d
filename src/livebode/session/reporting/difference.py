"""Two runs held against each other line by line: the mean responses, their ratio, and which lines differ."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log

import numpy as np
from numpy.typing import NDArray

from livebode.core import PER_LINE, GridError, Lines, Response, Responses, widened
from livebode.fitting import RunningMean
from livebode.records import Run
from livebode.session.averaged import Averaged, averaged
from livebode.session.axis import TrackingSection
from livebode.session.said import said

Floats = NDArray[np.float64]

ALPHA = 0.05
"""How often two runs of the same machine may be told apart at any line at all."""
_PLACES = 12
_ALONG = 1.645 / 2**0.5  # sigma of a complex value covers both parts; one of them stays within this with 95 %
_WINDOWS_MIN = 3.0  # side by side in a place, for a scatter that means something
_SAME_HZ = 1e-6
_SPEEDS_APART = 0.2


@dataclass(frozen=True, eq=False)
class Difference:
    """What changed at the lines that both runs have.

    |G₂ − G₁|²/σ², with σ² = σ₂² + max(1, |G₂/G₁|²)·σ₁², follows F(2, 2d) where nothing changed (d by Welch and
    Satterthwaite), so that p = (1 + |G₂ − G₁|²/(σ²·d))^−d. A line differs where p < α/m for m lines (Bonferroni), which
    is where the ratio's bound does not cover 1: over all lines together a false claim comes at most with α = 5 %.

    Attributes
    ----------
    before, after
        The mean responses; on the common lines, over the common places where both runs have a schedule.
    ratio, bound
        G₂/G₁ and the radius around it that holds with 95 % at all lines together, (lines,).
    p
        (lines,).
    seen
        The relative change at each line that this comparison finds with a probability of 95 %, (lines,).
    m
        How many were tested together.
    """

    before: Response
    after: Response
    ratio: NDArray[np.complex128]
    bound: Floats
    p: Floats
    seen: Floats
    m: int

    @property
    def differs(self) -> NDArray[np.bool_]:
        """Which lines differ, (lines,)."""
        return np.asarray(self.p < ALPHA / self.m)

    @classmethod
    def of(cls, before: Response, after: Response, m: int | None = None) -> Difference:
        """Of two mean responses on the same lines; `m` where they are tested together with others."""
        known = before.valid & after.valid & np.isfinite(before.sigma) & np.isfinite(after.sigma)
        m = m or max(int(np.count_nonzero(known)), 1)
        with np.errstate(all="ignore"):
            ratio = np.where(known, after.value / before.value, np.nan)
            first, second = (np.maximum(1, np.abs(ratio)) * before.sigma) ** 2, after.sigma**2
            variance = first + second
            dof = variance**2 / (first**2 / before.dof + second**2 / after.dof)
            away = np.abs(after.value - before.value) ** 2 / variance
            p = np.where(known, np.where(np.isinf(dof), np.exp(-away), (1 + away / dof) ** -dof), np.nan)
            sigma = np.sqrt(variance) / np.abs(before.value)
            bound = np.where(known, widened(sigma, dof, float(np.sqrt(log(m / ALPHA)))), np.nan)
        return cls(before, after, ratio, bound, np.asarray(p), bound + _ALONG * sigma, m)


@dataclass(frozen=True, eq=False)
class Place:
    """One of the places that both runs went to: from where to where, forth (rising) or back, and the difference."""

    low: float
    high: float
    back: bool
    difference: Difference


@dataclass(frozen=True, eq=False)
class Compared:
    """Two runs: their difference over all, place by place, and what a reader has to know of both.

    Attributes
    ----------
    runs, averages
        Before and after.
    overall
        Of the means; of runs with a schedule of the means over the common places, which count alike.
    places
        By place and direction; empty without a schedule in both. Tested together.
    warnings
        What makes the comparison weaker than it looks, in sentences.
    """

    runs: tuple[Run, Run]
    averages: tuple[Averaged, Averaged]
    overall: Difference
    places: tuple[Place, ...]
    warnings: tuple[str, ...]


def compare(before: Run, after: Run) -> Compared:
    """Hold two runs against each other.

    Raises
    ------
    GridError
        If quantity or unit differ, or no line is common.
    SignalError
        If a run has no valid response.
    """
    _refuse(before, after)
    both = averaged(before), averaged(after)
    common, at = _common(before.lines, after.lines)
    warnings = _about(before, after, len(common))
    means: list[dict[tuple[int, bool], Responses]] = []
    span = (max(a.spans[0] for a in both), min(a.spans[1] for a in both))
    if all(a.moved for a in both) and not any(_averages(run) for run in (before, after)):
        warnings += _overlap(both, span)
        if span[1] > span[0]:
            means = [_by_place(run, span) for run in (before, after)]
    elif any(a.moved for a in both):
        warnings.append("Only one of the runs moved along a schedule: what differs may be the places, not the machine.")
    shared = sorted(means[0].keys() & means[1].keys()) if means else []
    if not shared:
        one, other = (_on(a.response, common, i) for a, i in zip(both, at))
        return Compared((before, after), both, Difference.of(one, other), (), tuple(warnings))
    pairs = [tuple(_on(m[key][0], common, i) for m, i in zip(means, at)) for key in shared]
    known = [_known(a) & _known(b) for a, b in pairs]
    m = max(int(np.sum(known)), 1)
    edges = np.linspace(*span, _PLACES + 1)
    places = tuple(
        Place(float(edges[i]), float(edges[i + 1]), back, Difference.of(a, b, m))
        for (i, back), (a, b) in zip(shared, pairs)
    )
    together = [_together([pair[i] for pair in pairs], np.array(known)) for i in (0, 1)]
    return Compared((before, after), both, Difference.of(together[0], together[1]), places, tuple(warnings))


def _refuse(before: Run, after: Run) -> None:
    for what in ("quantity", "unit"):
        one, other = (run.found.get(what, "") for run in (before, after))
        if one != other:
            raise GridError(
                "not-alike",
                f"{before.path.name!r} has the {what} {one!r} and {after.path.name!r} {other!r}: such responses have "
                "nothing in common",
                f"compare runs of the same {what}",
                what=what,
                values=[one, other],
            )


def _common(before: Lines, after: Lines) -> tuple[Lines, tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """The common lines on the grid of the first run, and where they stand in both."""
    f, g = before.frequency_hz, after.frequency_hz
    nearest = np.abs(f[:, np.newaxis] - g).argmin(axis=1)
    first = np.flatnonzero(np.abs(g[nearest] / f - 1) < _SAME_HZ)
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


def _about(before: Run, after: Run, common: int) -> list[str]:
    """What in the settings makes two responses differ though the machine does not."""
    words = []
    if common < max(len(before.lines), len(after.lines)):
        words.append(
            f"The runs share {common} of {len(before.lines)} and {len(after.lines)} lines; these are compared."
        )
    one, other = (said(run.summary).get("tracking", {}) for run in (before, after))
    for key, what in (("estimator", "estimators"), ("hann", "windows"), ("differenced", "differencing")):
        usual = getattr(TrackingSection(), key)
        if (a := one.get(key, usual)) != (b := other.get(key, usual)):
            words.append(f"Different {what} ({a} and {b}) may make a difference of their own.")
    if before.lines.rate_hz != after.lines.rate_hz:
        words.append(
            f"The rates differ ({before.lines.rate_hz:g} and {after.lines.rate_hz:g} Hz), and with them the delay of "
            "the hold that is in every response."
        )
    if ("motion" in before.found) != ("motion" in after.found):
        words.append("Only one of the runs is freed from the axis's motion.")
    return words


def _averages(run: Run) -> bool:
    return bool(run.summary.get("configuration", {}).get("tracking", {}).get("average"))


def _overlap(both: tuple[Averaged, Averaged], span: tuple[float, float]) -> list[str]:
    words = " and ".join(f"{a.spans[0]:.4g} … {a.spans[1]:.4g}" for a in both)
    if span[1] <= span[0]:
        return [f"The runs have no place in common ({words} of the schedule): what differs may be the place."]
    said = []
    if span[1] - span[0] < 0.9 * max(a.spans[1] - a.spans[0] for a in both):
        said.append(f"The runs went different ways ({words} of the schedule); only the common part is compared.")
    speeds = [_speeds(a.overview) for a in both]
    fast = [float(np.median(s)) if s.size else 0.0 for s in speeds]
    if max(fast) > (1 + _SPEEDS_APART) * min(fast):
        said.append(
            f"The runs went at different speeds (typically {fast[0]:.3g} and {fast[1]:.3g} a second), and a response "
            "in motion depends on it: what differs may be the speed."
        )
    return said


def _speeds(of: Responses) -> Floats:
    with np.errstate(all="ignore"):
        speed = np.abs(np.diff(of.schedule) / np.diff(of.time_s))
    speed = speed[np.isfinite(speed)]
    return np.asarray(speed[speed > 0.1 * np.max(speed, initial=0.0)])


def _by_place(run: Run, span: tuple[float, float]) -> dict[tuple[int, bool], Responses]:
    """The mean at each place of the span, going forth and going back; those with too few windows are left out."""
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


def _on(one: Response, lines: Lines, at: NDArray[np.intp]) -> Response:
    """The response at some of its lines."""
    rows = {name: getattr(one, name)[at] for name in PER_LINE}
    return replace(one, lines=lines, **rows)


def _known(one: Response) -> NDArray[np.bool_]:
    return np.asarray(one.valid & np.isfinite(one.sigma))


def _together(parts: list[Response], known: NDArray[np.bool_]) -> Response:
    """The mean over places, each counted alike, at each line over those where both runs know it."""
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
