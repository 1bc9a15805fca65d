"""The findings of the first page: alarms, what to check, what is not assessed, and what is OK."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import isfinite

from livebode.analysis import MARGINS, worst
from livebode.core import Finding, Tone
from livebode.language import listed, number, tr, trn, worded
from livebode.records import RunRecord
from livebode_reports.events import alarms
from livebode_reports.parameter_track import failed, fitted, reasons
from livebode_reports.report_data import ReportData, RunData
from livebode_reports.wording import share

_URGENT: dict[Tone, int] = {"alarm": 0, "differs": 0, "check": 1, "open": 2, "ok": 3}
_INVALID_MANY = 0.05  # share of the rows
_EPSILON_LARGE = 0.1  # share of the response that the model does not explain
# Usual limits in motion control; a loop beyond them rings.
_PHASE_MIN_DEG, _MS_MAX = 30.0, 2.0


def verdict(of: ReportData) -> tuple[Finding, ...]:
    """The findings, the most urgent first."""
    measurement = of_measurement(_valid(of), _fits(of), _validated(of))
    return by_urgency([*about_record(of), *_margins(of), *measurement])


def by_urgency(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """The findings, the most urgent first."""
    return tuple(sorted(findings, key=lambda f: _URGENT[f.tone]))


def about_record(of: RunData) -> list[Finding]:
    """The findings about alarms, the record and its signals."""
    return [*alarms(of.run, of.event_summary), *of_measurement(_record(of), _ready(of), _signals(of))]


def of_measurement(*findings: Iterable[Finding]) -> list[Finding]:
    """Findings that are not about the machine: these do not become its verdict."""
    return [replace(finding, subject="measurement") for each in findings for finding in each]


def _record(of: RunData) -> list[Finding]:
    findings = []
    if not of.run.ended:
        findings.append(
            Finding(
                "check",
                tr(
                    "The run is not finished: it is still recording, or it was stopped. The report covers the data so "
                    "far."
                ),
            )
        )
    findings += [
        Finding("check", tr("The signals are doubtful: {why}.", why=worded(event.words)))
        for event in of.event_summary.in_full
        if event.kind == "doubtful"
    ]
    lost = of.event_summary.count("record-paused")
    if lost:
        text = trn(
            "The record paused {n} time because the disk was full or failed.",
            "The record paused {n} times because the disk was full or failed.",
            lost,
        )
        findings.append(Finding("check", text))
    return findings


def _ready(of: RunData) -> list[Finding]:
    """How long the machine was not ready; with a baseline, the summary of the monitoring contains it."""
    suppressed_s = of.run.summary.get("readiness", {}).get("suppressed_s")
    if not suppressed_s or of.run.summary.get("monitoring", {}).get("baseline") is not None:
        return []
    return [Finding("open", tr("Not assessed for {time:.1f} s: the machine was not ready.", time=suppressed_s))]


def _signals(of: RunData) -> list[Finding]:
    counts = of.run.summary.get("counts", {})
    findings = []
    if counts.get("gaps"):
        findings.append(Finding("check", _gaps(counts["gaps"], counts.get("missing", 0))))
    for key, words in (
        ("non-finite", tr("Not finite")), ("implausible", tr("Implausibly large")), ("spike", tr("Spikes")),
    ):  # fmt: skip
        if counts.get(key):
            text = trn(
                "{what}: {n:,} sample of {all:,}.", "{what}: {n:,} samples of {all:,}.", counts[key],
                what=words, all=of.samples,
            )  # fmt: skip
            findings.append(Finding("check", text))
    if counts and not findings:
        findings.append(Finding("ok", tr("The signals have no gap, no sample that is not finite, and no spike.")))
    return findings


def _gaps(gaps: int, missing: int) -> str:
    if not missing:
        return trn("The signals have {n:,} gap.", "The signals have {n:,} gaps.", gaps)
    samples = trn("{n:,} sample", "{n:,} samples", missing)
    return trn(
        "The signals have {n:,} gap, with {samples} missing.", "The signals have {n:,} gaps, with {samples} missing.",
        gaps, samples=samples,
    )  # fmt: skip


def _valid(of: ReportData) -> list[Finding]:
    unexpected, every = of.of.incomplete - _after_starts(of.run), of.of.count
    findings = []
    if unexpected > _INVALID_MANY * every:
        text = trn(
            "{bad:,} of {n:,} response ({share}) has an invalid line, beside those that contain a start or a gap.",
            "{bad:,} of {n:,} responses ({share}) have an invalid line, beside those that contain a start or a gap.",
            every, bad=unexpected, share=share(unexpected, every),
        )  # fmt: skip
        findings.append(Finding("check", text))
    if never := [f"{number(f, 'g')} Hz" for f, n in zip(of.run.lines.frequency_hz, of.of.valid) if not n]:
        lines = listed(never[:8]) + " …" * (len(never) > 8)
        findings.append(Finding("check", tr("Never valid: {lines}.", lines=lines)))
    return findings


def _after_starts(run: RunRecord) -> int:
    """Responses whose window contains the start or a gap."""
    hop = run.found.get("hop", run.lines.window)
    return int((1 + run.summary.get("counts", {}).get("gaps", 0)) * (-(-run.lines.window // hop) - 1))


def _fits(of: ReportData) -> list[Finding]:
    if of.fit is None:
        return [Finding("check", of.fit_words)] if "fit" in of.configuration else []
    rough = of.fit.epsilon > _EPSILON_LARGE
    values = {"model": worded(of.fit.model.name), "percent": 100 * of.fit.epsilon}
    text = tr("The {model} model, fitted to the run's mean: model error ε = {percent:.2g} % of |G|.", **values)
    if rough and of.of.moved:
        text = tr(
            "The {model} model, fitted to the run's mean: model error ε = {percent:.2g} % of |G|; the axis moved, so "
            "one model of the mean is not valid: see the fits over the run.",
            **values,
        )
    findings = [Finding("check" if rough or not of.fit.complete else "ok", text)]
    for track in of.tracks.values():
        if track.model != MARGINS and (why := failed(track)):
            every, rejected = fitted(track), sum(why.values())
            if rejected > _INVALID_MANY * every:
                text = trn(
                    "Of {n:,} fit over the run, {rejected:,} was rejected: {reasons}.",
                    "Of {n:,} fits over the run, {rejected:,} were rejected: {reasons}.",
                    every, rejected=rejected, reasons=reasons(why),
                )  # fmt: skip
                findings.append(Finding("check", text))
    return findings


def _margins(of: ReportData) -> list[Finding]:
    if of.loop is None:
        return [Finding("open", of.loop_words)] if of.described else []
    least = worst(of.loop.places)
    if not least:
        return [Finding("check", tr("No margins: {why}.", why=worded(str(of.loop.margins.status[0]))))]
    small = least["phase_margin"] < _PHASE_MIN_DEG or least["peak_sensitivity"] > _MS_MAX
    sizes = listed(
        f"{words} {number(least[name], '.3g')}{unit}"
        if isfinite(least[name])
        else tr("{margin} without limit", margin=words)
        for words, name, unit in (
            (tr("gain"), "gain_margin", " dB"),
            (tr("phase"), "phase_margin", "°"),
            (tr("delay"), "delay_margin", " ms"),
            ("Ms", "peak_sensitivity", ""),
        )
    )
    fits = len(of.loop.places)
    over = trn(
        "Worst margins of {n:,} fit over the run: {sizes}.", "Worst margins of {n:,} fits over the run: {sizes}.",
        fits, sizes=sizes,
    )  # fmt: skip
    text = over if fits > 1 else tr("Worst margins of the fit: {sizes}.", sizes=sizes)
    return [Finding("check" if small else "ok", text)]


def _validated(of: ReportData) -> list[Finding]:
    if of.judged is None:
        text = tr("The model was not validated on independent data.")
        return [Finding("open", text)] if of.fit is not None else []
    return list(of.judged.findings())
