"""The findings of the first page: alarms, what to check, what is not assessed, and what is OK."""

from __future__ import annotations

from math import isfinite

from livebode.analysis.parameter_track import MARGINS, failed
from livebode.core.document import Finding, Tone
from livebode.margins import worst
from livebode.reporting.alarms import alarms
from livebode.reporting.material import Material
from livebode.reporting.wording import many, share

_URGENT: dict[Tone, int] = {"alarm": 0, "differs": 0, "check": 1, "open": 2, "ok": 3}
_INVALID_MANY = 0.05
_EPSILON_LARGE = 0.1
# Usual limits in motion control; a loop beyond them rings.
_PHASE_MIN_DEG, _MS_MAX = 30.0, 2.0
_TRUSTED: dict[str, Tone] = {"passes": "ok", "small error": "ok", "fails": "check", "cannot be judged": "open"}


def verdict(of: Material) -> tuple[Finding, ...]:
    """The findings, the most urgent first."""
    found = [
        *alarms(of.run, of.happenings),
        *_record(of),
        *_signals(of),
        *_valid(of),
        *_fits(of),
        *_margins(of),
        *_validated(of),
    ]
    return tuple(sorted(found, key=lambda f: _URGENT[f.tone]))


def _record(of: Material) -> list[Finding]:
    found = []
    if not of.run.finished:
        found.append(
            Finding(
                "check",
                "The run is not finished: it is still recording, or it was stopped. The report covers the data so far.",
            )
        )
    found += [
        Finding("check", f"The signals are doubtful: {event.message}.")
        for event in of.happenings.in_full
        if event.kind == "doubtful"
    ]
    lost = of.happenings.count("record-paused")
    if lost:
        found.append(Finding("check", f"The record paused {lost} times because the disk was full or failed."))
    return found


def _signals(of: Material) -> list[Finding]:
    counts = of.run.summary.get("counts", {})
    found = []
    if counts.get("gaps"):
        missing = f", with {many(counts['missing'], 'sample')} missing" if counts.get("missing") else ""
        found.append(Finding("check", f"The signals have {many(counts['gaps'], 'gap')}{missing}."))
    for key, words in (("non-finite", "Not finite"), ("implausible", "Implausibly large"), ("spike", "Spikes")):
        if counts.get(key):
            found.append(Finding("check", f"{words}: {many(counts[key], 'sample')} of {of.samples:,}."))
    if counts and not found:
        found.append(Finding("ok", "The signals have no gap, no sample that is not finite, and no spike."))
    return found


def _valid(of: Material) -> list[Finding]:
    bad, every = of.of.incomplete, of.of.count
    text = f"{many(every, 'response')} at {many(len(of.run.lines), 'line')}; {bad:,} of them ({share(bad, every)}) "
    text += "have an invalid line (the first window after a start or a gap is always invalid)."
    found = [Finding("check" if bad > _INVALID_MANY * every else "ok", text)]
    if never := [f"{f:g} Hz" for f, n in zip(of.run.lines.frequency_hz, of.of.valid) if not n]:
        found.append(Finding("check", f"Never valid: {', '.join(never[:8])}{' …' * (len(never) > 8)}."))
    return found


def _fits(of: Material) -> list[Finding]:
    if of.fit is None:
        return [Finding("check", of.fit_words)] if "fit" in of.configuration else []
    lacks = f"model error ε = {100 * of.fit.epsilon:.2g} % of |G|"
    rough = of.fit.epsilon > _EPSILON_LARGE
    if rough and of.of.moved:
        lacks += "; the axis moved, so one model of the mean is not valid: see the fits over the run"
    found = [Finding("check" if rough else "ok", f"The {of.fit.model.name} model, fitted to the run's mean: {lacks}.")]
    for track in of.tracks.values():
        if track.model != MARGINS and (why := failed(track)):
            every, not_ok = sum(track.statuses.values()), sum(why.values())
            reasons = ", ".join(f"{count:,} {word}" for word, count in why.items())
            tone = "check" if not_ok > _INVALID_MANY * every else "ok"
            found.append(Finding(tone, f"Of {many(every, 'fit')} over the run, {not_ok:,} were rejected: {reasons}."))  # type: ignore[arg-type]
    return found


def _margins(of: Material) -> list[Finding]:
    if of.loop is None:
        return [Finding("open", of.loop_words)] if of.described else []
    least = worst(of.loop.places)
    if not least:
        return [Finding("check", f"No margins: {of.loop.message}.")]
    small = least["phase_margin"] < _PHASE_MIN_DEG or least["peak_sensitivity"] > _MS_MAX
    where = f"of {many(len(of.loop.places), 'fit')} over the run" if len(of.loop.places) > 1 else "of the fit"
    sizes = [
        f"{words} {least[name]:.3g}{unit}" if isfinite(least[name]) else f"{words} without limit"
        for words, name, unit in (
            ("gain", "gain_margin", " dB"),
            ("phase", "phase_margin", "°"),
            ("delay", "delay_margin", " ms"),
            ("Ms", "peak_sensitivity", ""),
        )
    ]
    return [Finding("check" if small else "ok", f"Worst margins {where}: {', '.join(sizes)}.")]


def _validated(of: Material) -> list[Finding]:
    if of.judged is None:
        text = "The model was not validated on independent data; use `livebode report RUN --on LOG`."
        return [Finding("open", text)] if of.fit is not None else []
    return [Finding(_TRUSTED[v.verdict], f"On {of.judged.on}: {v.sentence}.") for v in of.judged.found]
