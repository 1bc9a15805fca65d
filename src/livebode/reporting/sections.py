"""The sections of a run's report, one function each."""

from __future__ import annotations

from math import isfinite, isinf, isnan
from typing import Any

import numpy as np

from livebode.analysis.parameter_track import MARGINS, Track
from livebode.core.clock import moment
from livebode.core.document import Listing, Paragraph, Part, Picture, Section, Table
from livebode.margins.words import WORDS
from livebode.reporting.alarms import alarms
from livebode.reporting.material import Material, by_schedule
from livebode.reporting.wording import (
    BOUND_95,
    many,
    pairs,
    polar_rows,
    share,
    to_toml,
    with_bound,
)

_LINES_SHOWN = 60
_PANELS, _CURVES = 8, 700  # parameters that are drawn, and responses per curve
_TRACES_MAX, _TRACED = 10, 500  # lines that are drawn as traces, and responses per trace


def response(of: Material) -> Section:
    """The mean with its bounds, the fitted model, and a table."""
    one = of.of.response
    names = (of.channels["input"], of.channels["output"]) if {"input", "output"} <= of.channels.keys() else None
    caption = (
        f"Bars: {of.of.words}, with 95 % bounds. Light: range of 5–95 % of the single responses"
        f"{_thinned(of)}.{' Dashed: the ' + of.fit.model.name + ' model fitted to it.' if of.fit else ''}"
    )
    picture = Picture("bode", {"responses": of.of.overview, "mean": one, "names": names, "fitted": of.fit}, caption)
    frequency = one.lines.frequency_hz
    rows = [
        (f"{f:g}", *polar, f"{c:.4f}" if isfinite(c) else "—", share(n, of.of.count))
        for f, polar, c, n in zip(frequency, polar_rows(one, BOUND_95), one.coherence, of.of.valid)
    ]
    step = -(-len(rows) // _LINES_SHOWN)
    note = f"Every {step}th of {len(rows)} lines; responses.parquet contains all." if step > 1 else ""
    table = Table(
        ("Hz", f"dB{_re(of)}", "± dB", "degrees", "± degrees", "coherence γ²", "valid"),
        tuple(rows[::step]), tuple(range(7)), note,
    )  # fmt: skip
    return Section("Frequency response", (picture, table))


def tracking(of: Material) -> Section:
    """Magnitude of the lines over time and over the schedule, if there is one."""
    where = f" and over {of.channels.get('schedule', 'the schedule')}" if by_schedule(of.of) else ""
    shown = of.of.overview
    if len(shown.lines) <= _TRACES_MAX:
        shown = shown[:: -(-len(shown) // _TRACED)]
    caption = f"Magnitude at each line over time{where}, with 99.7 % bounds{_drawn(of, len(shown))}."
    data = {"responses": shown, "schedule_name": of.channels.get("schedule", "")}
    return Section("Tracking", (Picture("tracking", data, caption),))


def parameters(of: Material) -> Section | str:
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
        mean = with_bound(*fitted[name]) if name in fitted else ("fixed" if now and not now.sigma else "—", "")
        late = with_bound(now.value, 1.96 * now.sigma) if now else ("—", "")
        rows.append((name.replace("_", " "), *mean, *late, units.get(name) or (now.unit if now else "")))
    note = f"Of the mean: {of.fit.about_bounds}." if of.fit else "± covers 95 % if the model is complete."
    at = next((n.time_s for n in newest.values()), float("nan"))
    headings = ("", "of the mean", "±", f"newest, at {moment(at, 2)}" if newest else "newest", "±", "unit")
    if of.fit is not None:
        low, high = of.fit.band_hz
        words = (
            f"The {of.fit.model.name} model, fitted to {of.fit_words}, at {many(of.fit.lines, 'line')} from {low:g} "
        )
        words += f"to {high:g} Hz. Model error ε = {100 * of.fit.epsilon:.2g} % of |G|"
        words += f"; reduced χ² {of.fit.chi2:.3g} from sigma alone." if isfinite(of.fit.chi2) else "."
        parts.append(Paragraph(words))
    else:
        parts.append(Paragraph(of.fit_words))
    parts.append(Table(headings, tuple(rows), (1, 2, 3, 4), note))
    parts.extend(_over_time(of, track, "Parameters") for track in tracks if _moving(track))
    return Section("Parameters", tuple(parts))


def motion(of: Material) -> Section | None:
    """The model of the axis in motion; None if the run was not corrected for motion."""
    model = of.run.found.get("motion", {}).get("model")
    if model is None:
        return None
    words = (
        f"The newest chunk's model: Js {model['inertia_kg_m2']:.5g} kg m², mL {model['load_kg']:.5g} kg; by position:"
    )
    columns = zip(model["position_m"], model["stiffness_n_per_m"], model["damping_n_s_per_m"])
    rows = tuple((f"{x:.4g}", f"{k:.5g}", f"{b:.4g}") for x, k, b in columns)
    table = Table(("position in m", "Keff in N/m", "bs in N s/m"), rows, (0, 1, 2))
    return Section("Motion", (Paragraph(words), table))


def margins(of: Material) -> Section | str:
    """The margins of the loop, with bounds and frequencies."""
    if of.loop is None:
        return of.loop_words
    if of.loop.message:
        return f"No margins: {of.loop.message}."
    found = of.loop.margins
    bound = found.bound()[0]
    rows = []
    for i, (name, unit) in enumerate(zip(found.names, found.units)):
        value, at = found.value[0, i], found.frequency_hz[0, i]
        if isnan(at):
            rows.append((WORDS[name], "any amount" if isinf(value) else "none", "", unit, "", "no crossing"))
            continue
        mark = "between the lines" if found.place[0, i] == "interpolated" else "EXTRAPOLATED: no line checks it"
        rows.append((WORDS[name], *with_bound(value, bound[i]), unit, f"{at:.4g}", mark))
    size, around, at_hz = of.loop.at_lines
    about = "" if of.fit is None else f"Of the fit: {of.fit.about_bounds}. "
    note = f"{about}From the lines alone, without a model, Ms is at least {size:.3g} ± {around:.2g} "
    note += f"(at {at_hz:g} Hz). Tuning {of.loop.tuning.verdict}: {of.loop.tuning.sentence}"
    table = Table(("margin", "value", "±", "unit", "at Hz", "range"), tuple(rows), (1, 2, 4), note)
    caption = (
        "Open loop L of the fit with its 95 % band, and the measured lines. Right: near −1, with the circle of Ms."
    )
    parts: list[Part] = [table, Picture("loop", {"found": of.loop}, caption)]
    if MARGINS in of.tracks and _moving(of.tracks[MARGINS]):
        parts.append(_over_time(of, of.tracks[MARGINS], "Margins"))
    return Section("Margins of the loop", tuple(parts))


def events(of: Material) -> Section:
    """Alarms and other events."""
    monitoring = of.run.summary.get("monitoring", {})
    words = alarms(of.run, of.happenings)[0].text
    if monitoring.get("baseline"):
        words += f" Baseline {monitoring['baseline']}, judged by {monitoring.get('judged_by', '—')}; false alarms: "
        words += f"{monitoring.get('false_alarms', '—')}."
        if covariates := monitoring.get("covariates"):
            words += f" Covariates: {', '.join(covariates)}."
    return Section("Alarms and events", (Paragraph(words), *of.happenings.parts()))


def quality(of: Material) -> Section:
    """Gaps, bad samples, invalid responses and the state of the source."""
    counts = of.run.summary.get("counts", {})
    rows = [
        ("samples", f"{of.samples:,}"),
        *((words, f"{counts[key]:,}") for key, words in _COUNTS.items() if counts.get(key) is not None),
        ("responses", f"{of.of.count:,}"),
        ("with an invalid line", f"{of.of.incomplete:,} ({share(of.of.incomplete, of.of.count)})"),
    ]
    table = pairs(rows)
    parts: list[Part] = [table]
    if "counts" not in of.run.summary:
        parts.append(Paragraph("The counts of samples are written at the end of the run."))
    if source := of.run.summary.get("source"):
        parts.append(pairs([(_SOURCE.get(key, key), _plain(value)) for key, value in source.items()]))
    if (speed := of.run.summary.get("speed")) is not None:
        words = f"{speed['recorded_s']:.4g} s of signals were tracked in {speed['run_s']:.3g} s"
        parts.append(Paragraph(f"{words} ({speed['times_real_time']:.3g} times real time)."))
    return Section("Data quality", tuple(parts))


_COUNTS = {
    "gaps": "gaps", "missing": "missing samples", "non-finite": "samples that are not finite",
    "implausible": "implausibly large samples", "spike": "spikes",
}  # fmt: skip
_SOURCE = {
    "connected": "connected at the end", "lost": "lost samples", "silent_s": "silent, s",
    "measured_hz": "rate of arrival, Hz", "clock_offset_s": "sender's clock at sample 0",
    "latency_s": "latency, s", "waiting_bytes": "bytes waiting", "waiting_s": "backlog, s",
    "first_sample": "first sample", "counts": "events",
}  # fmt: skip


def validation(of: Material) -> Section | str:
    """Validation of the model on independent data, or why there is none."""
    if of.judged is None:
        return "No validation: the model was not tested on independent data. Use `livebode report RUN --on LOG`."
    parts: list[Part] = [Paragraph(f"{v.sentence}.") for v in of.judged.found]
    rows = tuple(
        (
            v.model, c.name, f"{100 * c.share:.0f} %", f"{c.largest:.3g}", f"{c.p:.2g}",
            "yes" if c.name in v.judged_by else "no",
        )
        for v in of.judged.found
        for c in v.correlations
    )  # fmt: skip
    headings = ("model", "ε with", "lags inside", "largest", "joint p", "counts")
    parts.append(Table(headings, rows, (2, 3, 4), " ".join(f"{n}." for n in of.judged.notes)))
    caption = f"On {of.judged.on}: measured and simulated output, and the residual's correlations with their limits."
    parts.append(Picture("validation", {"found": of.judged.found}, caption))
    return Section("Validation", tuple(parts))


def settings(of: Material) -> Section:
    """The complete configuration as TOML, with all defaults."""
    return Section("Settings", (Listing(to_toml(of.configuration) or "# none"),))


def versions(of: Material) -> Section:
    """Versions of the software."""
    rows = [(name.replace("_", " "), str(value)) for name, value in of.run.summary.get("versions", {}).items()]
    return Section("Versions", (pairs(rows),))


def _over_time(of: Material, track: Track, what: str) -> Picture:
    names = [name for name in track.values if np.isfinite(track.values[name]).any() and track.newest[name].sigma > 0]
    shown = [name for name in names if not name.endswith("_frequency")][:_PANELS]
    every = slice(None, None, -(-len(track.time_s) // _CURVES))
    time_s = track.time_s[every]
    data = {
        "time_s": time_s,
        "curves": [(n, track.newest[n].unit, track.values[n][every], 1.96 * track.sigmas[n][every]) for n in shown],
    }
    return Picture("parameters", data, f"{what} over time, with 95 % bounds{_drawn(of, len(time_s))}.")


def _moving(track: Track) -> bool:
    return any(np.count_nonzero(np.isfinite(v)) > 1 and track.newest[n].sigma > 0 for n, v in track.values.items())


def _thinned(of: Material) -> str:
    return _drawn(of, len(of.of.overview))


def _drawn(of: Material, kept: int) -> str:
    return f" (thinned: {kept:,} of {of.of.count:,} responses)" if kept < of.of.count else ""


def _re(of: Material) -> str:
    return f" re 1 {of.run.found['unit']}" if of.run.found["unit"] else ""


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {_plain(count)}" for name, count in value.items() if count) or "none"
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
