"""The limits of a machine in a report: which are met, which are failed, and which the data do not decide."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, isfinite, isinf

from livebode.configuration import MAGNITUDES, LimitSection
from livebode.core import TONES, Answer, Finding, Paragraph, PrintedTable, Section, with_bound
from livebode.language import Message, number, tr, trn, worded
from livebode_reports.acceptance import LimitResult

_WORDS = {
    "resonance_hz": Message("resonance"), "resonance_damping": Message("resonance damping"),
    "antiresonance_hz": Message("antiresonance"), "antiresonance_damping": Message("antiresonance damping"),
    "stiffness": Message("stiffness"), "inertia": Message("inertia"), "load_mass": Message("load mass"),
    "damping": Message("damping"), "delay_s": Message("delay"), "gain_margin_db": Message("gain may rise by"),
    "gain_reduction_db": Message("gain may fall by"), "phase_margin_deg": Message("phase margin"),
    "delay_margin_ms": Message("delay margin"), "max_sensitivity": Message("peak sensitivity Ms"),
    "bandwidth_hz": Message("bandwidth"),
}  # fmt: skip


def about_limits(accepted: Sequence[LimitResult]) -> list[Finding]:
    """The verdict on the limits, in one sentence for each kind of result."""
    failed = [a for a in accepted if a.result == "fail"]
    undecided = [a for a in accepted if a.result == "undecided"]
    findings = []
    if failed:
        text = trn(
            "{n:,} limit of {all} is not met: {which}.", "{n:,} limits of {all} are not met: {which}.", len(failed),
            all=len(accepted), which="; ".join(map(_short, failed)),
        )  # fmt: skip
        findings.append(Finding("fail", text))
    if undecided:
        text = trn(
            "The measurement does not decide {n:,} limit of {all}: {which}.",
            "The measurement does not decide {n:,} limits of {all}: {which}.", len(undecided),
            all=len(accepted), which="; ".join(map(_short, undecided)),
        )  # fmt: skip
        findings.append(Finding("undecided", text))
    if accepted and not findings:
        text = trn(
            "{n:,} limit is met, by more than the bound of the measurement.",
            "All {n:,} limits are met by more than the bounds of the measurement.", len(accepted),
        )  # fmt: skip
        findings.append(Finding("pass", text))
    return findings


def limits(accepted: Sequence[LimitResult]) -> Section | None:
    """The table of the limits; None if there are none."""
    if not accepted:
        return None
    headings = (tr("quantity"), tr("limit"), tr("measured"), "±", tr("unit"), tr("result"))
    rows = tuple((_name(a.limit), _range(a.limit), *_value(a), _result(a)) for a in accepted)
    rule = tr(
        "A limit is met only if the measured value is inside by more than its 95 % bound, and failed only if it is "
        "outside by more than that (guard band after ISO 14253-1 and JCGM 106). Otherwise the measurement does not "
        "decide. Where there are several values, over a band or over the travel of the axis, the bound covers all "
        "together with 95 %, and the value that is nearest to the limit is shown."
    )
    return Section(tr("Limits"), (PrintedTable(headings, rows, (2, 3)), Paragraph(rule)))


def answer_of(a: LimitResult) -> Answer:
    """The measured value beside its limit, for the first page."""
    value, bound, unit = _value(a)
    text = " ".join(filter(None, (f"{value} ± {bound}" if bound else value, unit)))
    return Answer(_name(a.limit), worded(a.reason) if a.reason else text, _range(a.limit), a.result)


def _name(limit: LimitSection) -> str:
    if limit.quantity in MAGNITUDES:
        words = f"{limit.quantity} ({worded(MAGNITUDES[limit.quantity])})"
        if limit.band_hz is None:
            return words
        low, high = (number(f, "g") for f in limit.band_hz)
        return tr("{quantity}, {low} … {high} Hz", quantity=words, low=low, high=high)
    if limit.quantity in _WORDS:
        return worded(_WORDS[limit.quantity])
    pole, which, kind = limit.quantity.split("_")
    return f"{worded(_WORDS[f'{pole}_{kind}'])} {which}"


def _range(limit: LimitSection) -> str:
    low = "" if limit.min is None else f"≥ {number(limit.min, 'g')}"
    high = "" if limit.max is None else f"≤ {number(limit.max, 'g')}"
    return ", ".join(filter(None, (low, high)))


def _value(a: LimitResult) -> tuple[str, str, str]:
    if a.reason:
        return "—", "—", ""
    unit = a.unit if not isfinite(a.at_hz) else tr("{unit}, at {at:g} Hz", unit=a.unit, at=a.at_hz)
    if isinf(a.value):
        return tr("any amount"), "", worded(unit)
    if isinf(a.bound):
        return number(a.value, ".4g"), tr("unbounded"), worded(unit)
    return *with_bound(a.value, a.bound), worded(unit)


def _result(a: LimitResult) -> str:
    word = worded(TONES[a.result])
    if a.reason:
        return tr("{result}: {why}", result=word, why=worded(a.reason))
    if a.result != "undecided":
        return word
    if isinf(a.times):
        return tr("{result}: too close to the limit", result=word)
    factor = number(ceil(10 * a.times) / 10, "g") if a.times < 10 else number(ceil(a.times), ",")
    return tr("{result}: needs about {factor} times the data", result=word, factor=factor)


def _short(a: LimitResult) -> str:
    """Quantity, limit and measured value in a sentence."""
    head = f"{_name(a.limit)} {_range(a.limit)}"
    if a.reason:
        return f"{head} ({worded(a.reason)})"
    value, bound, unit = _value(a)
    return f"{head} ({value} ± {bound} {unit})" if bound else f"{head} ({value} {unit})"
