"""The verdict on two runs: alarms, differences and the smallest detectable change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite, log10

import numpy as np
from numpy.typing import NDArray

from livebode.core import Finding, Tone
from livebode.language import listed, number, tr, trn, worded
from livebode_reports.changes import Changes, QuantityChange, percent
from livebode_reports.difference import Difference, PlaceDifference, RunDifferences
from livebode_reports.events import EventSummary, alarms
from livebode_reports.wording import polar_phrase

_URGENT: tuple[Tone, ...] = ("alarm", "differs", "check", "open", "ok")


def verdict(differences: RunDifferences, changes: Changes) -> tuple[Finding, ...]:
    """The findings, the most urgent first."""
    findings = [
        *_alarms(differences),
        *(Finding("check", worded(text)) for text in differences.warnings),
        _overall(differences.overall),
        *_by_place(differences.places),
        *_parameters(changes.parameters),
        *_margins(changes.margins),
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
    f, worst = d.before.lines.frequency_hz, int(np.nanargmin(d.p))
    words = trn(
        "{n:,} line of {m} differs: {lines}.", "{n:,} lines of {m} differ: {lines}.", int(d.differs.sum()),
        m=d.m, lines=_hz(f[d.differs]),
    )  # fmt: skip
    ratio = polar_phrase(complex(d.ratio[worst]), float(d.bound[worst]))
    words += " " + tr("Most certain at {at:g} Hz: {ratio}.", at=f[worst], ratio=ratio)
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


def detectable(*each: Difference) -> str:
    """The smallest detectable change of the response, or of several; empty if no line can be compared."""
    seen = np.concatenate([d.seen[np.isfinite(d.p)] for d in each])
    return _sizes(seen) if seen.size else ""


def _seen(places: Sequence[Difference]) -> str:
    return tr("detectable: {sizes}", sizes=_sizes(np.concatenate([d.seen[np.isfinite(d.p)] for d in places])))


def _sizes(seen: NDArray[np.float64]) -> str:
    """At every line and at the best line."""
    least, most = 100 * float(seen.min()), 100 * float(seen.max())
    if most < 1.5 * least:
        return tr("≥ {most:.2g} %", most=most)
    return tr("≥ {most:.2g} % at every line, ≥ {least:.2g} % at the best line", most=most, least=least)


def _parameters(table: tuple[QuantityChange, ...]) -> Iterator[Finding]:
    moved, listing = _changed(table)
    if moved:
        text = trn(
            "{n:,} parameter of {all} changed: {changes}.", "{n:,} parameters of {all} changed: {changes}.", moved,
            all=len(table), changes=listing,
        )  # fmt: skip
        yield Finding("differs", text)
    elif table:
        without = tr("No significant change of a parameter.")
        seen = tr("No significant change of a parameter (detectable: {changes}).", changes=listing)
        yield Finding("ok", seen if listing else without)


def _margins(table: tuple[QuantityChange, ...]) -> Iterator[Finding]:
    moved, listing = _changed(table)
    if moved:
        text = trn(
            "{n:,} margin of {all} changed: {changes}.", "{n:,} margins of {all} changed: {changes}.", moved,
            all=len(table), changes=listing,
        )  # fmt: skip
        yield Finding("differs", text)
    elif table:
        without = tr("No significant change of a margin.")
        seen = tr("No significant change of a margin (detectable: {changes}).", changes=listing)
        yield Finding("ok", seen if listing else without)


def _changed(table: tuple[QuantityChange, ...]) -> tuple[int, str]:
    """Number of significant changes with their list; if there are none, the list of the detectable changes."""
    moved = [c for c in table if c.significant]
    if moved:
        return len(moved), "; ".join(
            f"{worded(c.words)} {number(percent(c, c.amount), '+.2g')} % ± {number(percent(c, c.bound), '.2g')} %"
            for c in moved[:6]
        )
    return 0, "; ".join(
        f"{worded(c.words)} ≥ {number(percent(c, c.seen), '.2g')} %" for c in table[:6] if isfinite(percent(c, c.seen))
    )


def _hz(frequency_hz: NDArray[np.float64]) -> str:
    shown = listed(number(f, "g") for f in frequency_hz[:12])
    return f"{shown}{' …' if len(frequency_hz) > 12 else ''} Hz"
