"""The sections of a run's report, one function each."""

from __future__ import annotations

from math import isfinite, log10
from typing import Any

import numpy as np

from livebode.analysis import MARGINS, loop_section
from livebode.core import (
    INTERVAL_FACTOR,
    OK,
    Listing,
    Paragraph,
    Part,
    Picture,
    PrintedTable,
    Response,
    Section,
    moment,
    with_bound,
)
from livebode.fitting import Fit
from livebode.language import Message, listed, number, quantity_name, tr, worded
from livebode_reports.events import alarms
from livebode_reports.parameter_track import Track, reasons
from livebode_reports.report_data import ReportData, RunData, by_schedule
from livebode_reports.stored_picture import stored_svg
from livebode_reports.svg import STORED
from livebode_reports.wording import (
    line_table,
    lines_of,
    pairs,
    polar_rows,
    share,
    to_toml,
)

_PANELS, _CURVES = 8, 700  # parameters that are drawn, and responses per curve
_TRACES_MAX, _TRACED = 10, 500  # lines that are drawn as traces, and responses per trace


def average(of: ReportData) -> Picture:
    """The mean with its bounds and the fitted model: the picture of the first page."""
    shown = of.shown
    names = (of.channels["input"], of.channels["output"]) if {"input", "output"} <= of.channels.keys() else None
    caption = tr("Measured: {what}, with 95 % bounds.", what=worded(of.of.words))
    if of.fit:
        caption += " " + tr("Dashed: the {model} model fitted to it.", model=worded(of.fit.model.name))
    if unit := of.drive_unit:
        caption += " " + tr(
            "Units of the drive: 1 {si} = {factor:.5g} {unit}, {db:+.2f} dB; parameters and limits are in SI units.",
            si=of.run.found["unit"], factor=unit.factor, unit=unit.unit, db=20 * log10(unit.factor),
        )  # fmt: skip
    data = {"responses": shown.overview, "mean": shown.mean, "names": names, "fitted": shown.model}
    return Picture("bode", data, caption)


def response(of: ReportData) -> Section:
    """The mean at each line, with its bounds."""
    mean = of.shown.mean
    frequency = mean.lines.frequency_hz
    rows = [
        (number(f, "g"), *polar, number(c, ".4f") if isfinite(c) else "—", *parts, share(n, of.of.count))
        for f, polar, c, parts, n in zip(frequency, polar_rows(mean), mean.coherence, _parts(mean), of.of.valid)
    ]
    headings: tuple[str, ...] = (
        "Hz",
        f"dB{_re(mean.unit)}",
        "± dB",
        tr("degrees"),
        tr("± degrees"),
        tr("coherence γ²"),
    )
    of_parts = (tr("noise, %"), tr("distortion, %"), tr("time variation, %"))
    headings = *headings, *(of_parts if _has_parts(mean) else ()), tr("valid")
    return Section(tr("Frequency response"), (line_table(headings, rows),))


def _has_parts(response: Response) -> bool:
    """Whether more than noise is known in sigma."""
    return any(bool((np.isfinite(part) & (part > 0)).any()) for part in (response.distortion, response.variation))


def _parts(response: Response) -> list[tuple[str, ...]]:
    """Standard deviations of noise, distortion and time variation at each line, in percent of the response."""
    if not _has_parts(response):
        return [()] * len(response.lines)
    parts = response.noise, response.distortion, response.variation
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = [100 * part / np.abs(response.value) for part in parts]
    return [tuple(number(x, ".2g") if isfinite(x) else "—" for x in row) for row in zip(*shares)]


def tracking(of: ReportData) -> Section:
    """Magnitude of the lines over time and over the schedule, if there is one."""
    shown = of.shown.overview
    if len(shown.lines) <= _TRACES_MAX:
        shown = shown[:: -(-len(shown) // _TRACED)]
    thinned = _drawn(of, len(shown))
    caption = tr("Magnitude at each line over time, with 95 % bounds{thinned}.", thinned=thinned)
    if by_schedule(of.of):
        schedule = of.channels.get("schedule", tr("the schedule"))
        caption = tr(
            "Magnitude at each line over time and over {schedule}, with 95 % bounds{thinned}.",
            schedule=schedule, thinned=thinned,
        )  # fmt: skip
    data = {"responses": shown, "schedule_name": of.channels.get("schedule", "")}
    return Section(tr("Tracking"), (Picture("tracking", data, caption),))


def parameters(of: ReportData) -> Section | str:
    """Fitted parameters: of the mean, newest, and over time."""
    tracks = [t for t in of.tracks.values() if t.model != MARGINS]
    if of.fit is None and not tracks:
        return of.fit_words
    parts: list[Part] = []
    newest = tracks[0].newest if tracks else {}
    units = {name: unit for name, _, _, unit in of.fit.rows()} if of.fit else {}
    fitted = {name: (value, bound) for name, value, bound, _ in of.fit.rows()} if of.fit else {}
    rows = []
    for name in dict.fromkeys([*fitted, *newest]):
        now = newest.get(name)
        mean = with_bound(*fitted[name]) if name in fitted else (tr("fixed") if now and not now.sigma else "—", "")
        late = with_bound(now.value, INTERVAL_FACTOR * now.sigma) if now else ("—", "")
        rows.append((quantity_name(name), *mean, *late, worded(units.get(name) or (now.unit if now else ""))))
    note = tr("± covers 95 % if the model is complete.")
    if of.fit:
        note = tr("Of the mean: {bounds}.", bounds=worded(of.fit.about_bounds))
    newest_s = next((n.time_s for n in newest.values()), float("nan"))
    late_at = tr("newest, at {time}", time=moment(newest_s, 2)) if newest else tr("newest")
    headings = ("", tr("of the mean"), "±", late_at, "±", tr("unit"))
    parts.append(Paragraph(of.fit_words if of.fit is None else _fitted(of.fit, of.fit_words)))
    parts.append(PrintedTable(headings, tuple(rows), (1, 2, 3, 4), note))
    parts.extend(_over_time(of, track, tr("Parameters")) for track in tracks if _moving(track))
    return Section(tr("Parameters"), tuple(parts))


def _fitted(fit: Fit, words: str) -> str:
    low, high = fit.band_hz
    values = {
        "model": worded(fit.model.name), "what": worded(words), "lines": lines_of(fit.lines), "low": low,
        "high": high, "percent": 100 * fit.epsilon, "chi2": fit.chi2,
    }  # fmt: skip
    if isfinite(fit.chi2):
        return tr(
            "The {model} model, fitted to {what}, at {lines} from {low:g} to {high:g} Hz. Model error ε = "
            "{percent:.2g} % of |G|; reduced χ² {chi2:.3g} from sigma alone.",
            **values,
        )
    return tr(
        "The {model} model, fitted to {what}, at {lines} from {low:g} to {high:g} Hz. Model error ε = "
        "{percent:.2g} % of |G|.",
        **values,
    )


def stabilisation(of: ReportData) -> Section | str | None:
    """The stabilisation chart that a fit of modes has drawn in the run's directory; None where none has."""
    path = of.run.path / "stabilisation.svg"
    if not path.is_file():
        return None
    caption = tr(
        "Poles of models of increasing order over frequency, as drawn when the modes were fitted. A pole that stays "
        "from order to order belongs to a mode of the machine."
    )
    svg = stored_svg(path, caption)
    if svg is None:
        return tr(
            "No stabilisation chart: the file in the run's directory was changed. Use `livebode fit RUN --model modal` "
            "to draw it again."
        )
    return Section(tr("Stabilisation chart"), (Picture(STORED, {"svg": svg}, caption),))


def motion(of: ReportData) -> Section | None:
    """The model of the axis in motion; None if the run was not corrected for motion."""
    model = of.run.found.get("motion", {}).get("model")
    if model is None:
        return None
    words = tr(
        "The newest chunk's model: motor inertia {inertia:.5g} kg m², load mass {load:.5g} kg; by position:",
        inertia=model["inertia_kg_m2"], load=model["load_kg"],
    )  # fmt: skip
    columns = zip(model["position_m"], model["stiffness_n_per_m"], model["damping_n_s_per_m"])
    rows = tuple((number(x, ".4g"), number(k, ".5g"), number(b, ".4g")) for x, k, b in columns)
    table = PrintedTable(
        (tr("position in m"), tr("belt stiffness in N/m"), tr("belt damping in N s/m")), rows, (0, 1, 2)
    )
    return Section(tr("Motion"), (Paragraph(words), table))


def margins(of: ReportData) -> Section | str:
    """The margins of the loop, with bounds and frequencies."""
    if of.loop is None:
        return of.loop_words
    if of.loop.message:
        return tr("No margins: {why}.", why=worded(of.loop.message))
    over_time: list[Part] = []
    if MARGINS in of.tracks and _moving(of.tracks[MARGINS]):
        over_time.append(_over_time(of, of.tracks[MARGINS], tr("Margins")))
    return loop_section(of.loop, over_time)


def events(of: RunData) -> Section:
    """Alarms and other events."""
    monitoring = of.run.summary.get("monitoring", {})
    words = alarms(of.run, of.event_summary)[0].text
    if name := monitoring.get("baseline"):
        version = monitoring.get("baseline_id")
        named = f"{name} ({version})" if version else str(name)
        words += " " + tr(
            "Baseline {baseline}, judged by {judge}; mean time between false alarms: {days} days of motion or more.",
            baseline=named, judge=worded(str(monitoring.get("judged_by", "—"))),
            days=monitoring.get("false_alarm_interval_days", "—"),
        )  # fmt: skip
        if covariates := monitoring.get("covariates"):
            words += " " + tr("Covariates: {names}.", names=listed(covariates))
    return Section(tr("Alarms and events"), (Paragraph(words), *of.event_summary.parts()))


def quality(of: RunData) -> Section:
    """Gaps, bad samples, and the responses and fits that are not valid, as those of a start."""
    counts, extent = of.run.summary.get("counts", {}), of.extent
    rows = [
        (tr("samples"), number(of.samples, ",")),
        *((worded(words), number(counts[key], ",")) for key, words in _COUNTS.items() if counts.get(key) is not None),
        (tr("responses"), number(extent.count, ",")),
        (tr("with an invalid line"), f"{number(extent.incomplete, ',')} ({share(extent.incomplete, extent.count)})"),
    ]
    if isinstance(of, ReportData):
        rows += [(tr("fits over the run"), _counted(track)) for track in of.tracks.values() if track.model != MARGINS]
    parts: list[Part] = [pairs(rows)]
    if "counts" not in of.run.summary:
        parts.append(Paragraph(tr("The counts of samples are written at the end of the run.")))
    return Section(tr("Data quality"), tuple(parts))


def _counted(track: Track) -> str:
    """Number of fits, and why rows have none."""
    rows, without = sum(track.statuses.values()), {word: n for word, n in track.statuses.items() if word != OK}
    if not without:
        return number(rows, ",")
    return tr("{rows:,} (rejected: {reasons})", rows=rows, reasons=reasons(without))


def source_state(of: RunData) -> Section | None:
    """The state of the source at the end, and the speed; None if neither was recorded."""
    parts: list[Part] = []
    if source := of.run.summary.get("source"):
        parts.append(pairs([(worded(_SOURCE.get(key, key)), _plain(value)) for key, value in source.items()]))
    if (speed := of.run.summary.get("speed")) is not None:
        words = tr(
            "{recorded:.4g} s of signals were tracked in {run:.3g} s ({times:.3g} times real time).",
            recorded=speed["recorded_s"], run=speed["run_s"], times=speed["times_real_time"],
        )  # fmt: skip
        parts.append(Paragraph(words))
    return Section(tr("Source"), tuple(parts)) if parts else None


_COUNTS = {
    "gaps": Message("gaps"), "missing": Message("missing samples"),
    "non-finite": Message("samples that are not finite"),
    "implausible": Message("implausibly large samples"), "spike": Message("spikes"),
}  # fmt: skip
_SOURCE = {
    "connected": Message("connected at the end"), "lost": Message("lost samples"), "silent_s": Message("silent, s"),
    "measured_hz": Message("rate of arrival, Hz"), "clock_offset_s": Message("sender's clock at sample 0"),
    "latency_s": Message("latency, s"), "waiting_bytes": Message("bytes waiting"), "waiting_s": Message("backlog, s"),
    "first_sample": Message("first sample"), "counts": Message("events"),
}  # fmt: skip


def validation(of: ReportData) -> Section | str:
    """Validation of the model on independent data, or why there is none."""
    if of.judged is None:
        return tr("No validation: the model was not tested on independent data. Use `livebode report RUN --on LOG`.")
    return of.judged.section()


def settings(of: RunData) -> Section:
    """The complete configuration as TOML, with all defaults."""
    return Section(tr("Settings"), (Listing(to_toml(of.configuration) or "# none"),))


def versions(of: RunData) -> Section:
    """Versions of the software."""
    rows = [(name.replace("_", " "), str(value)) for name, value in of.run.summary.get("versions", {}).items()]
    return Section(tr("Versions"), (pairs(rows),))


def _over_time(of: ReportData, track: Track, words: str) -> Picture:
    names = [name for name in track.values if np.isfinite(track.values[name]).any() and track.newest[name].sigma > 0]
    shown = [name for name in names if not name.endswith("_frequency")][:_PANELS]
    every = slice(None, None, -(-len(track.time_s) // _CURVES))
    time_s = track.time_s[every]
    data = {
        "time_s": time_s,
        "curves": [
            (n, track.newest[n].unit, track.values[n][every], INTERVAL_FACTOR * track.sigmas[n][every]) for n in shown
        ],
    }
    thinned = _drawn(of, len(time_s))
    caption = tr("{what} over time, with 95 % bounds{thinned}.", what=words, thinned=thinned)
    return Picture("parameters", data, caption)


def _moving(track: Track) -> bool:
    return any(np.count_nonzero(np.isfinite(v)) > 1 and track.newest[n].sigma > 0 for n, v in track.values.items())


def _drawn(of: ReportData, kept: int) -> str:
    return tr(" (thinned: {kept:,} of {all:,} responses)", kept=kept, all=of.of.count) if kept < of.of.count else ""


def _re(unit: str) -> str:
    return tr(" re 1 {unit}", unit=unit) if unit else ""


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return listed(f"{worded(name)} {_plain(count)}" for name, count in value.items() if count) or tr("none")
    if value is None:
        return ""
    if isinstance(value, bool):
        return tr("yes") if value else tr("no")
    return number(value, ".6g") if isinstance(value, float) else str(value)
