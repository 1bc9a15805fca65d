"""The verdict on two runs: alarms, differences and the smallest detectable change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite, log10

import numpy as np
from numpy.typing import NDArray

from livebode.core import Finding, Tone, with_bound
from livebode.language import number, quantity_name, tr, trn, worded
from livebode_reports.changes import Changes, QuantityChange, by_importance, percent
from livebode_reports.difference import Difference, PlaceDifference, RunDifferences
from livebode_reports.events import EventSummary, alarms
from livebode_reports.wording import polar_phrase, share, signed

_CHANGES_MAX = 6
_URGENT: tuple[Tone, ...] = ("alarm", "differs", "check", "open", "ok")


def verdict(differences: RunDifferences, changes: Changes) -> tuple[Finding, ...]:
    """The findings, the most urgent first."""
    findings = [
        *_alarms(differences),
        *(Finding("check", worded(text)) for text in differences.warnings),
        *parameters(changes.parameters),
        *_margins(changes.margins),
        _overall(differences.overall),
        *_by_place(differences.places),
    ]
    return tuple(sorted(findings, key=lambda finding: _URGENT.index(finding.tone)))


def _alarms(differences: RunDifferences) -> Iterator[Finding]:
    """Alarms of both runs; none for a finished run without a baseline."""
    for run, when in zip(differences.runs, (tr("Before"), tr("After"))):
        if run.summary.get("monitoring", {}).get("baseline") is not None or not run.ended:
            for finding in alarms(run, EventSummary.of(run.each_event_and_damage())):
                if finding.tone != "ok":
                    yield Finding(finding.tone, f"{when}: {finding.text}")


def _overall(d: Difference) -> Finding:
    if not np.isfinite(d.p).any():
        return Finding("open", tr("There is no line at which both runs have a valid mean with a known sigma."))
    if not d.differs.any() and d.ignored.any():
        return Finding("ok", _ignored(d))
    if not d.differs.any():
        text = tr("No line differs by more than chance ({m} tested together; {seen}).", m=d.m, seen=_seen([d]))
        return Finding("ok", text)
    worst = int(most_certain(d)[0])
    words = trn(
        "{n:,} line of {m} differs: at {at:g} Hz by {ratio}.",
        "{n:,} lines of {m} differ, most certainly at {at:g} Hz: {ratio}.", int(d.differs.sum()), m=d.m,
        at=d.before.lines.frequency_hz[worst], ratio=polar_phrase(complex(d.ratio[worst]), float(d.bound[worst])),
    )  # fmt: skip
    return Finding("differs", f"{words} {_ignored(d)}" if d.ignored.any() else words)


def _ignored(d: Difference) -> str:
    """Lines whose difference is certain, but smaller than matters."""
    size = 100 * d.ignore_below
    return trn(
        "{n:,} line of {m} differs by less than the {size:.2g} % ({db:.2g} dB) that matter, and is ignored.",
        "{n:,} lines of {m} differ by less than the {size:.2g} % ({db:.2g} dB) that matter, and are ignored.",
        int(d.ignored.sum()), m=d.m, size=size, db=20 * log10(1 + d.ignore_below),
    )  # fmt: skip


def _by_place(places: tuple[PlaceDifference, ...]) -> Iterator[Finding]:
    if not places:
        return
    if not any(np.isfinite(p.difference.p).any() for p in places):
        yield Finding("open", tr("There is no place at which both runs have a valid mean with a known sigma."))
        return
    there = [p for p in places if p.difference.differs.any()]
    count = sum(int(p.difference.differs.sum()) for p in there)
    values = {"count": count, "pairs": places[0].difference.m, "there": len(there)}
    if there:
        words = trn(
            "By place: {count} of {pairs} pairs of line and place differ, at {there} of {n:,} place (forward and "
            "return counted separately).",
            "By place: {count} of {pairs} pairs of line and place differ, at {there} of {n:,} places (forward and "
            "return counted separately).",
            len(places), **values,
        )  # fmt: skip
        yield Finding("differs", words)
        return
    words = trn(
        "By place: {count} of {pairs} pairs of line and place differ, at {there} of {n:,} place (forward and return "
        "counted separately; {seen}).",
        "By place: {count} of {pairs} pairs of line and place differ, at {there} of {n:,} places (forward and return "
        "counted separately; {seen}).",
        len(places), seen=_seen([p.difference for p in places]), **values,
    )  # fmt: skip
    yield Finding("ok", words)


def most_certain(d: Difference) -> NDArray[np.intp]:
    """Indices of the lines that differ, the most certain first."""
    return np.asarray(sorted(np.flatnonzero(d.differs), key=lambda i: (d.p[i], -abs(d.ratio[i] - 1) / d.bound[i])))


def detectable(*each: Difference) -> str:
    """The smallest detectable change of the response, or of several; empty if no line can be compared."""
    seen = np.concatenate([d.seen[np.isfinite(d.p)] for d in each])
    return _sizes(seen) if seen.size else ""


def _seen(places: Sequence[Difference]) -> str:
    return tr("detectable: {sizes}", sizes=_sizes(np.concatenate([d.seen[np.isfinite(d.p)] for d in places])))


def _sizes(seen: NDArray[np.float64]) -> str:
    """At half of the lines, and the range: one line of an antiresonance does not stand for all."""
    least, median, most = map(float, np.quantile(seen, (0, 0.5, 1)))
    if most < 1.5 * least:
        return tr("≥ {most}", most=share(most, 1))
    return tr(
        "≥ {median} at half of the lines ({least} … {most})", median=share(median, 1), least=share(least, 1),
        most=share(most, 1),
    )  # fmt: skip


def parameters(table: tuple[QuantityChange, ...]) -> Iterator[Finding]:
    """The changes of the parameters, or that none is significant; nothing without parameters."""
    yield from _about(table, tr("No significant change of a parameter"))


def _margins(table: tuple[QuantityChange, ...]) -> Iterator[Finding]:
    yield from _about(table, tr("No significant change of a margin"))


def _about(table: tuple[QuantityChange, ...], unchanged: str) -> Iterator[Finding]:
    """The changes, the most important first; if there are none, what would have been detected."""
    ranked = by_importance(table)
    if changed := [c for c in ranked if c.significant]:
        together = tr("± covers all changes of the table together with 95 %.")
        listing = "; ".join(f"{quantity_name(c.name)} {in_percent(c)}" for c in changed[:_CHANGES_MAX])
        yield Finding("differs", f"{listing}. {together}")
    elif ranked:
        seen = [
            f"{quantity_name(c.name)} ≥ {number(percent(c, c.seen), '.2g')} %"
            for c in ranked[:_CHANGES_MAX] if isfinite(percent(c, c.seen))
        ]  # fmt: skip
        text = tr("{none} (detectable: {changes})", none=unchanged, changes="; ".join(seen)) if seen else unchanged
        yield Finding("ok", f"{text}.")


def in_percent(c: QuantityChange) -> str:
    """The change with its bound, in percent of the value before; of a value of zero, in its unit."""
    scale = percent(c, 1.0)
    unit = "%" if isfinite(scale) else worded(c.unit)
    text, around = with_bound(*(x * (scale if isfinite(scale) else 1.0) for x in (c.amount, c.bound)))
    return f"{signed(text)} ± {around} {unit}".rstrip().replace("-", "−")
