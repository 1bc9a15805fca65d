"""How it was measured, in words; and its details for the appendix."""

from __future__ import annotations

from typing import Any

from livebode.core import Paragraph, Part, PrintedTable, Section, moment
from livebode.language import Message, listed, number, tr, trn, worded
from livebode.locations import location, resolved
from livebode_reports.report_data import ReportData, RunData, recordings
from livebode_reports.wording import duration, pairs

_ESTIMATOR = {
    "joint": Message("joint: S_wy/S_wu, unbiased in any linear loop"),
    "direct": Message("direct: S_uy/S_uu, biased if y is fed back to u"),
    "lpm": Message("lpm: local polynomial method, for an excitation that does not repeat"),
    "welch": Message("welch: averaged Hann windows, for an excitation that does not repeat"),
    "indirect": Message("indirect: response of the closed loop, from which the described controllers are removed"),
}
_NOISE = {
    "periods": Message("the scatter between windows that are whole periods apart"),
    "auto": Message(
        "the scatter between windows that are whole periods apart; where the schedule moves, detection lines "
        "(non-excited bins)"
    ),
    "bins": Message("what the local polynomials do not explain at the bins around each line"),
    "windows": Message("what the response does not explain in the averaged windows"),
    "quiet": Message("detection lines (non-excited bins); at standstill the scatter between periods if it is larger"),
}
_ROLES = {
    "excitation": Message("excitation w"),
    "input": Message("plant input u"),
    "output": Message("output y"),
    "schedule": Message("schedule"),
}


def how(of: ReportData) -> Section:
    """The section "How it was measured"."""
    facts, tracking = of.run.found, of.configuration.get("tracking", {})
    noise = facts.get("judged", {}).get("noise", tracking.get("noise", ""))
    rows = [
        *signal_rows(of),
        (tr("quantity"), _quantity(facts)),
        *grid_rows(of),
        (tr("bounds from"), worded(_NOISE.get(noise, ""))),
        (tr("options"), listed(_options(tracking, of))),
    ]
    return Section(tr("How it was measured"), (Paragraph(_in_words(of)), pairs(rows), Paragraph(about_bounds())))


def about_bounds() -> str:
    """What a bound contains."""
    return tr(
        "The effective time of a response is the centre of its window. A bound contains the true response with the "
        "stated probability. It covers noise, and distortion where it is detected; "
        "it does not cover a systematic error that the signals do not show."
    )


def signal_rows(of: RunData) -> list[tuple[str, str]]:
    """Names and values of the signals: channels, rate, samples and responses."""
    rate_hz = of.run.found["rate_hz"]
    return [
        *((worded(_ROLES[role]), of.channels[role]) for role in _ROLES if role in of.channels),
        (tr("rate"), f"{number(rate_hz, 'g')} Hz" + _rate_from(of.run.found)),
        (tr("samples"), listed((number(of.samples, ","), duration(of.samples / rate_hz)))),
        (tr("run's clock"), " … ".join(moment(at_s, 2) for at_s in of.extent.spans_s)),
        (tr("responses"), number(of.extent.count, ",")),
    ]


def grid_rows(of: RunData) -> list[tuple[str, str]]:
    """Names and values of the lines, the window, the hop and the estimator."""
    facts, f = of.run.found, of.run.lines.frequency_hz
    window_s = facts["window"] / facts["rate_hz"]
    return [
        (tr("lines"), trn(
            "{n:,} line, {low:g} … {high:g} Hz on a grid of {step:.4g} Hz",
            "{n:,} lines, {low:g} … {high:g} Hz on a grid of {step:.4g} Hz",
            len(f), low=f[0], high=f[-1], step=1 / window_s,
        )),
        (tr("window"), tr(
            "{samples} samples, {ms:.4g} ms: a whole number of periods of each line",
            samples=facts["window"], ms=1000 * window_s,
        )),
        (tr("hop"), _hop(facts)),
        (tr("estimator"), worded(_ESTIMATOR.get(of.configuration.get("tracking", {}).get("estimator", ""), ""))),
    ]  # fmt: skip


def _in_words(of: ReportData) -> str:
    if of.entry:
        return matrix_in_words(of)
    return (
        _added(of)
        + " "
        + tr(
            "Each response is computed from one window of the signals. The report shows the mean of all responses. ± "
            "is the bound within which the true value is with a probability of 95 %, unless another one is stated."
        )
    )


def matrix_in_words(of: RunData) -> str:
    """How a matrix of responses was measured, in two sentences."""
    return (
        _added(of)
        + " "
        + tr(
            "Each matrix of responses is computed from several experiments, one after the other, in which the inputs "
            "move differently. ± is the bound within which the true value is with a probability of 95 %, unless "
            "another one is stated."
        )
    )


def _added(of: RunData) -> str:
    if "excitation" in of.channels:
        return tr(
            "A small excitation was added in the control loop while the machine was in operation. From the signals, "
            "livebode computed how the machine responds at each excited frequency (line)."
        )
    return tr("From the signals of the machine, livebode computed how it responds at each frequency (line).")


def details(of: RunData) -> Section:
    """Where the signals came from, and the described controllers with the keys of the configuration."""
    source = of.configuration.get("source", {})
    rows = [
        (tr("run"), str(resolved(location(of.run.place)))),
        (tr("source"), listed(recordings(source)) or str(source.get("url") or "")),
        (tr("format"), str(of.run.found.get("format", ""))),
        (tr("loop"), "; ".join(_loop(of.configuration.get("loop", {})))),
    ]
    return Section(tr("Details of the measurement"), (pairs(rows),))


def _options(tracking: dict[str, Any], of: ReportData) -> list[str]:
    parts = []
    if tracking.get("average"):
        forgetting = of.run.found.get("forgetting", 1)  # a matrix averages all its repetitions
        all_periods = tr("averaged over all periods")
        some = tr("averaged over periods with forgetting {forgetting:g}", forgetting=forgetting)
        parts.append(all_periods if forgetting == 1 else some)
    if tracking.get("differenced"):
        parts.append(tr("differenced: {channels}", channels=listed(tracking["differenced"])))
    if tracking.get("spikes"):
        parts.append(tr("windows with spikes of {channels} excluded", channels=listed(tracking["spikes"])))
    if tracking.get("hann"):
        parts.append(tr("Hann window"))
    if tracking.get("dtype") == "float32":
        parts.append(tr("single precision"))
    if "motion" in of.configuration:
        parts.append(tr("corrected for the axis's motion with a moving model"))
    return parts


def _loop(loop: dict[str, Any]) -> list[str]:
    """The described controllers in words; empty if there are none."""
    parts = [
        # The keys of the configuration, with numbers as in the file.
        f"{name}: {', '.join(f'{key} {value}' for key, value in loop[name].items() if value)}"
        for name in ("velocity", "position", "position_pd")
        if name in loop
    ]
    place = worded(str(loop.get("excitation_at")))
    return [tr("excitation at the {place}", place=place), *parts] if parts else []


def _rate_from(facts: dict[str, Any]) -> str:
    return f" ({worded(facts['rate_from'])})" if "rate_from" in facts else ""


def _quantity(facts: dict[str, Any]) -> str:
    name, unit = worded(facts["quantity"]), facts["unit"]
    return tr("{quantity}, in {unit}", quantity=name, unit=unit) if unit else tr("{quantity}, no unit", quantity=name)


def _hop(facts: dict[str, Any]) -> str:
    if "hop" not in facts:
        return ""
    per_s = facts["rate_hz"] / facts["hop"]
    return tr("{samples} samples, {per_s:.4g} responses/s", samples=facts["hop"], per_s=per_s)


_KINDS = {"even": Message("even"), "odd": Message("odd")}
_LINES_SHOWN = 60


def distortion(of: ReportData) -> Section | None:
    """Even and odd distortion, and the scatter between several recordings; None for one that shows no distortion."""
    parts: list[Part] = []
    if levels := of.run.found.get("judged", {}).get("levels"):
        parts += _levels(levels)
    if between := of.run.summary.get("between"):
        parts += _between(of, between)
    return Section(tr("Distortion"), tuple(parts)) if parts else None


def _between(of: ReportData, between: dict[str, Any]) -> list[Part]:
    level, noise = (_db(between.get(name)) for name in ("distortion_db", "noise_db"))
    words = tr("Same excitation: the response is the mean of {count} recordings.", count=between["recordings"])
    if between["realisations"]:
        words = tr(
            "Robust method: the response is the best linear approximation over {count} realisations of the excitation.",
            count=between["recordings"],
        )
    words += " " + tr(
        "Scatter between them beyond noise {level}, noise of the mean {noise}, relative to the output at a line.",
        level=level, noise=noise,
    )  # fmt: skip
    if not between["differs"]:
        words += " " + tr("Noise explains the scatter.")
    return [Paragraph(words), _standard_deviations(of, between)]


def _standard_deviations(of: ReportData, between: dict[str, Any]) -> PrintedTable:
    columns = [between[name] for name in ("noise_sigma", "total_sigma", "distortion")]
    rows = [
        (number(f, "g"), *("—" if value is None else number(100 * value / abs(size), ".2g") for value in values))
        for f, size, *values in zip(of.run.lines.frequency_hz, of.of.response.value, *columns)
    ]
    step = -(-len(rows) // _LINES_SHOWN)
    note = tr("Standard deviations in % of the response. One recording: the part beyond its noise.")
    headings = ("Hz", tr("mean, noise"), tr("mean, total"), tr("one recording"))
    return PrintedTable(headings, tuple(rows[::step]), (0, 1, 2, 3), note)


def _db(level: float | None) -> str:
    return tr("not known") if level is None else f"{number(level, '.1f')} dB"


def _levels(levels: dict[str, Any]) -> list[Part]:
    words = tr(
        "Fast method: even distortion appears at even bins, odd distortion at odd bins without excitation. Rms at "
        "these detection lines, relative to the output at a line; mean over {periods} periods.",
        periods=levels["periods"],
    )
    rows = tuple(_row(worded(word), levels.get(kind)) for kind, word in _KINDS.items())
    headings = (tr("distortion"), "dB", tr("95 % bounds, dB"), tr("noise, dB"), tr("detection lines"))
    return [Paragraph(words), PrintedTable(headings, rows, (1, 2, 3, 4))]


def _row(name: str, level: dict[str, Any] | None) -> tuple[str, ...]:
    if level is None:
        return name, tr("not measurable"), "—", "—", "—"
    high, noise, bins = (
        number(level["high_db"], ".1f"),
        number(level["noise_db"], ".1f"),
        str(level["detection_lines"]),
    )
    if level.get("db") is None:
        return name, tr("below {db}", db=high), "—", noise, bins
    return name, number(level["db"], ".1f"), f"{number(level['low_db'], '.1f')} … {high}", noise, bins
