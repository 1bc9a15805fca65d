"""The verdict on two runs: alarms, differences and the smallest detectable change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from livebode.analysis.changes import Change, Changes, percent
from livebode.analysis.difference import Compared, Difference, Place
from livebode.core.document import Finding, Tone
from livebode.reporting.alarms import alarms
from livebode.reporting.happenings import EventSummary
from livebode.reporting.wording import many, polar, signed

_URGENT: tuple[Tone, ...] = ("alarm", "differs", "check", "open", "ok")


def verdict(found: Compared, changes: Changes) -> tuple[Finding, ...]:
    """The findings, the most urgent first."""
    findings = [
        *_alarms(found),
        *(Finding("check", text) for text in found.warnings),
        _overall(found.overall),
        *_by_place(found.places),
        *_changed("parameter", changes.parameters),
        *_changed("margin", changes.margins),
    ]
    return tuple(sorted(findings, key=lambda finding: _URGENT.index(finding.tone)))


def _alarms(found: Compared) -> Iterator[Finding]:
    """Alarms of both runs; none for a finished run without a baseline."""
    for run, when in zip(found.runs, ("Before", "After")):
        if run.summary.get("monitoring", {}).get("baseline") is not None or not run.finished:
            for finding in alarms(run, EventSummary.of(run.each_event_and_damage())):
                if finding.tone != "ok":
                    yield Finding(finding.tone, f"{when}: {finding.text}")


def _overall(d: Difference) -> Finding:
    if not np.isfinite(d.p).any():
        return Finding("open", "There is no line at which both runs have a valid mean with a known sigma.")
    if not d.differs.any():
        return Finding("ok", f"No line differs by more than chance ({d.m} tested together; {_seen([d])}).")
    f, worst = d.before.lines.frequency_hz, int(np.nanargmin(d.p))
    verb = "differs" if d.differs.sum() == 1 else "differ"
    db, around, deg, turned = polar(complex(d.ratio[worst]), float(d.bound[worst]))
    words = f"{many(int(d.differs.sum()), 'line')} of {d.m} {verb}: {_hz(f[d.differs])}. "
    words += f"Most certain at {f[worst]:g} Hz: {signed(db)} ± {around} dB, {signed(deg)} ± {turned}°."
    return Finding("differs", words)


def _by_place(places: tuple[Place, ...]) -> Iterator[Finding]:
    if not places:
        return
    if not any(np.isfinite(p.difference.p).any() for p in places):
        yield Finding("open", "There is no place at which both runs have a valid mean with a known sigma.")
        return
    there = [p for p in places if p.difference.differs.any()]
    count = sum(int(p.difference.differs.sum()) for p in there)
    words = f"By place: {count} of {places[0].difference.m} pairs of line and place differ, at {len(there)} "
    words += f"of {many(len(places), 'place')} (forward and return counted separately"
    words += ")." if there else f"; {_seen([p.difference for p in places])})."
    yield Finding("differs" if there else "ok", words)


def _seen(found: Sequence[Difference]) -> str:
    """The smallest detectable change: at every line and at the best line."""
    seen = 100 * np.concatenate([d.seen[np.isfinite(d.p)] for d in found])
    least, most = float(seen.min()), float(seen.max())
    at = f"detectable: ≥ {most:.2g} %"
    return at if most < 1.5 * least else f"{at} at every line, ≥ {least:.2g} % at the best line"


def _changed(what: str, table: tuple[Change, ...]) -> Iterator[Finding]:
    if not table:
        return
    moved = [c for c in table if c.significant]
    listed = "; ".join(f"{c.words} {percent(c, c.amount):+.2g} % ± {percent(c, c.bound):.2g} %" for c in moved[:6])
    if moved:
        yield Finding("differs", f"{many(len(moved), what)} of {len(table)} changed: {listed}.")
        return
    seen = "; ".join(f"{c.words} ≥ {percent(c, c.seen):.2g} %" for c in table[:6] if isfinite(percent(c, c.seen)))
    yield Finding("ok", f"No significant change of a {what}" + (f" (detectable: {seen})." if seen else "."))


def _hz(frequency_hz: NDArray[np.float64]) -> str:
    shown = ", ".join(f"{f:g}" for f in frequency_hz[:12])
    return f"{shown}{' …' if len(frequency_hz) > 12 else ''} Hz"
