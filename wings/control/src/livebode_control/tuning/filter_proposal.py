"""A filter for the resonance, with the resulting margins, or the reason why none is proposed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from livebode.analysis import MARGIN_NAMES, Margins, OpenLoop, margins, worst
from livebode.core import FitError, Parameters, UsageError
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode_control.tuning.filters import Biquad, low_pass, notch_over

Verdict = Literal["none needed", "suggested", "refused"]

_DEPTHS_DB = (6.0, 10.0, 14.0, 20.0, 26.0, 32.0)
_LOW_PASSES = 24  # corners that are tried
_ROWS = 32  # of the fits, spread over the schedule: each filter is judged at all of them
_WIDEST = 2.0  # highest over lowest frequency of a resonance that a notch can follow
_SURE = 0.25  # of Ms: with a wider bound a comparison is meaningless
_PLACES = 1.96


@dataclass(frozen=True, eq=False)
class Proposal:
    """One filter and its effect.

    Attributes
    ----------
    kind
        "notch" or "low-pass".
    biquad
        Its coefficients at the controller's rate.
    about
        Centre or corner, depth and width as text and numbers.
    after
        Margins of the rows that were judged, with the filter.
    enough
        Whether the largest Ms, with its bound, stays below the target everywhere.
    """

    kind: str
    biquad: Biquad
    about: dict[str, float]
    after: Margins
    enough: bool


@dataclass(frozen=True, eq=False)
class Tuning:
    """Proposal for a loop.

    Attributes
    ----------
    verdict, sentence
        "none needed", "suggested" or "refused", and the reason.
    before
        Margins of the rows that were judged, without a filter.
    proposals
        The notch and the low-pass, the better one first; empty unless suggested.
    """

    verdict: Verdict
    sentence: Message
    before: Margins
    proposals: tuple[Proposal, ...] = ()

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        proposals = [
            {
                "kind": p.kind,
                "about": p.about,
                "rate_hz": p.biquad.rate_hz,
                "b": list(p.biquad.b),
                "a": [1.0, *p.biquad.a],
                "enough": p.enough,
                "margins": worst(p.after),
            }
            for p in self.proposals
        ]
        return {
            "verdict": self.verdict,
            "sentence": self.sentence,
            "margins": worst(self.before),
            "proposals": proposals,
        }


def tuning(
    fits: Parameters,
    loop: OpenLoop,
    band_hz: tuple[float, float],
    *,
    controller_rate_hz: float | None = None,
    peak_sensitivity: float = 2.0,
) -> Tuning:
    """Propose a notch and a low-pass where the loop is too close to instability.

    The criterion is the largest Ms over the rows (over positions, if the fits are of several), each with its 95 %
    bound. A notch covers the resonance's whole range over the rows, bound included, at half its depth or more; depth,
    and the low-pass's corner, are the mildest that reach the target, or else those with the least Ms. Each filter is
    judged on the whole loop, including its stability.

    Bias: a filter is as good as the model of the plant; it ignores what the model omits, such as another resonance.

    Parameters
    ----------
    fits
        Parameters of `loop.plant`; up to 32 rows, spread over the schedule, are judged.
    loop, band_hz
        As for `margins`.
    controller_rate_hz
        Computations of the filter per second; the loop's rate by default.
    peak_sensitivity
        Target for Ms. 2 leaves a gain margin of 6 dB and a phase margin of 29° or more.

    Raises
    ------
    UsageError
        If the target is not above 1.
    FitError
        If no row has a valid fit.
    """
    if not peak_sensitivity > 1:
        raise UsageError(
            "out-of-range",
            f"{peak_sensitivity=} is not above 1, the least that any loop has",
            "2 is usual",
            argument="peak_sensitivity",
            value=peak_sensitivity,
        )
    rows = _spread(fits)
    before = margins(rows, loop, band_hz)
    ms, bound = before.of("peak_sensitivity"), before.bound()[:, MARGIN_NAMES.index("peak_sensitivity")]
    if not before.ok.all():
        return Tuning(
            "refused",
            Message(
                "with {unstable} of {count} fits the loop would be unstable; if the machine runs, the loop's "
                "description or the fit is wrong",
                unstable=np.count_nonzero(~before.ok),
                count=len(rows),
            ),
            before,
        )
    largest = float(np.max(ms + bound))
    if np.any(bound > _SURE * ms):
        return Tuning(
            "refused", Message("Ms is known to ± {bound:.2g} only; take a longer run", bound=np.max(bound)), before
        )
    if largest <= peak_sensitivity:
        sentence = Message(
            "the largest Ms, bound included, is {largest:.3g}, below {limit:g}: no filter is needed",
            largest=largest,
            limit=peak_sensitivity,
        )
        return Tuning("none needed", sentence, before)
    ranges, reason = _ranges(rows, loop)
    if not ranges:
        return Tuning("refused", reason, before)
    rate_hz = controller_rate_hz or loop.rate_hz

    def tried(candidates: Iterator[tuple[Biquad, dict[str, float]]], kind: str) -> Proposal | None:
        return _mildest(candidates, kind, rows, loop, band_hz, peak_sensitivity)

    notches = (tried(_notches(span, rate_hz), Message("notch")) for span in ranges)
    filters = [p for p in (*notches, tried(_low_passes(ranges[0][1], rate_hz), Message("low-pass"))) if p is not None]
    better = sorted((p for p in filters if largest_ms(p.after) < largest), key=lambda p: largest_ms(p.after))
    if not better:
        return Tuning(
            "refused",
            Message("no notch or low-pass reduces Ms below its present value of {largest:.3g}", largest=largest),
            before,
        )
    best = better[0]
    facts = {
        "largest": largest,
        "limit": peak_sensitivity,
        "filter": best.kind,
        "after": largest_ms(best.after),
    }
    sentence = Message(
        "Ms is up to {largest:.3g}, above {limit:g}; a {filter} comes closest to it with {after:.3g}", **facts
    )
    if best.enough:
        sentence = Message(
            "Ms is up to {largest:.3g}, above {limit:g}; a {filter} reaches it with {after:.3g}", **facts
        )
    kinds = {p.kind: p for p in reversed(better)}
    return Tuning("suggested", sentence, before, tuple(p for p in better if kinds[p.kind] is p))


def largest_ms(margins: Margins) -> float:
    """Over the rows, with its 95 % bound; infinite where a row is unstable."""
    if not margins.ok.all():
        return float("inf")
    index = MARGIN_NAMES.index("peak_sensitivity")
    return float(np.max(margins.value[:, index] + margins.bound()[:, index]))


def _spread(fits: Parameters) -> Parameters:
    """Up to 32 valid rows, evenly spread over the schedule, or over the run without one."""
    good = np.flatnonzero(fits.ok)
    if not good.size:
        raise FitError(
            "not-fitted",
            "no response could be fitted, so there is no model to design a filter for",
            "see the status of the fits",
            rows=len(fits.ok),
        )
    order = good[np.argsort(fits.schedule[good], kind="stable")] if np.isfinite(fits.schedule[good]).all() else good
    chosen = np.unique(np.rint(np.linspace(0, order.size - 1, _ROWS)).astype(int))
    return fits[np.asarray(order[chosen])]


def _ranges(rows: Parameters, loop: OpenLoop) -> tuple[list[tuple[float, float, float]], Message]:
    """Lowest and highest frequency, bound included, and damping, of each resonance; or why there is none."""
    names = [
        n for n in loop.plant.derived_names if n.startswith("resonance") and f"{n}_damping" in loop.plant.derived_names
    ]
    reason = Message("the model {model} has no resonance to filter; fit one that has", model=repr(rows.model))
    if not names:
        return [], reason
    derived = rows.derived(loop.plant.derived_names, loop.plant.derived_units, loop.plant.derived)
    modes = []
    for name in names:
        f, sigma = derived[name], derived.sigma[:, derived.index(name)]
        low, high = float(np.min(f - _PLACES * sigma)), float(np.max(f + _PLACES * sigma))
        if low > 0 and high < _WIDEST * low and high < loop.rate_hz / 2:
            modes.append((low, high, float(np.max(derived[f"{name}_damping"]))))
        else:
            reason = Message(
                "the {quantity} is anywhere from {low:.4g} to {high:.4g} Hz, bound and variation included: too wide "
                "for a filter",
                quantity=Message(name.replace("_", " ")),
                low=max(low, 0),
                high=high,
            )
    return modes, reason


def _notches(span: tuple[float, float, float], rate_hz: float) -> Iterator[tuple[Biquad, dict[str, float]]]:
    low, high, damping = span
    for depth_db in _DEPTHS_DB:
        about = {"frequency_hz": float(np.sqrt(low * high)), "depth_db": depth_db, "from_hz": low, "to_hz": high}
        if high < rate_hz / 2:
            yield notch_over(low, high, depth_db, damping, rate_hz), about


def _low_passes(top_hz: float, rate_hz: float) -> Iterator[tuple[Biquad, dict[str, float]]]:
    for corner_hz in np.geomspace(0.45 * rate_hz, top_hz / 10, _LOW_PASSES).tolist():
        yield low_pass(corner_hz, rate_hz), {"frequency_hz": corner_hz}


def _mildest(
    candidates: Iterator[tuple[Biquad, dict[str, float]]],
    kind: str,
    rows: Parameters,
    loop: OpenLoop,
    band_hz: tuple[float, float],
    target: float,
) -> Proposal | None:
    """The first candidate that reaches the target, or the best."""
    best: Proposal | None = None
    for biquad, about in candidates:
        after = margins(rows, loop.behind(biquad), band_hz)
        enough = largest_ms(after) <= target
        if best is None or largest_ms(after) < largest_ms(best.after):
            best = Proposal(kind, biquad, about, after, enough)
        if enough:
            return best
    return best if best is not None and best.after.ok.all() else None
