"""Pictures and printed results at the end of a run."""

from __future__ import annotations

import os
import sys
from math import isnan
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any

from livebode.cli.terminal import is_terminal, print_drawn
from livebode.core import RunClock, counted, moment, moments_by, with_bound
from livebode.estimates import rule
from livebode.language import QUANTITY_NAMES, quantity_name
from livebode.locations import original

if TYPE_CHECKING:
    from livebode.fitting import CommonPoles, Fit
    from livebode.runtime import Estimate, Outcome, SingleResponse


_ALARMS_SHOWN = 8


def draw(estimate: Estimate, into: Path) -> None:
    """Draw the pictures of an estimate that a configuration describes."""
    axis = estimate.axis
    assert axis is not None
    rule(axis.kind, "draw")(estimate, into)


def draw_response(estimate: SingleResponse, into: Path) -> None:
    """Draw bode.svg and tracking.svg of an axis."""
    axis = estimate.axis
    assert axis is not None
    names = (axis.signals.input or axis.signals.excitation or "", axis.signals.output)
    draw_titled(estimate, into, title=f"{axis.source.title}: {axis.signals.output}", names=names)


def draw_titled(estimate: SingleResponse, into: Path, *, title: str, names: tuple[str, str]) -> None:
    """Draw bode.svg and tracking.svg with this title and names of input and output."""
    responses = estimate.overview.responses()
    if not len(responses):
        return
    from livebode.pictures import save_pictures

    schedule, fitted, mean = estimate.schedule_label, estimate.fit, estimate.average
    save_pictures(responses, into, title=title, schedule_name=schedule, names=names, fitted=fitted, mean=mean)


def show(outcome: Outcome) -> None:
    """Print the Bode plot and the results of a run."""
    from livebode.pictures import terminal_bode

    size = get_terminal_size((100, 30))
    print_drawn(
        terminal_bode(
            outcome.responses,
            width=min(size.columns, 140),
            height=max(16, min(size.lines - 4, 36)),
            colour=is_terminal() and "NO_COLOR" not in os.environ,
            unicode="utf" in (sys.stdout.encoding or "").lower(),
            mean=outcome.average,
        )
    )
    print(f"{tracked_amount(outcome.summary)}\n{original(str(outcome.directory))}/")
    found = outcome.summary["found"]
    for line in _judged(found):
        print(line)
    if (between := outcome.summary.get("between")) is not None and not between["differs"]:
        print(f"mean of {counted(between['recordings'], 'recording')}, which differ by no more than their noise")
    if (moving := found.get("motion", {}).get("model")) is not None:
        _show_moving(moving)
    if "fit" in outcome.summary:
        _show_statuses(outcome.summary["fit"])
    if outcome.fit is not None:
        with moments_by(RunClock.of(outcome.summary)):
            of = f"newest fit, at {moment(outcome.fit.parameters.time_s[0], 2)}"
            show_fit(outcome.fit, of if outcome.average is None else "the average of all periods")
    if "loop" in outcome.summary:
        _show_loop(outcome.summary["loop"])
    if "monitoring" in outcome.summary:
        show_monitoring(outcome.summary["monitoring"])


_LINES_SHOWN = 20
_NO_RESPONSE = "no response"  # status of a response without valid lines
_REASONS = {
    "distorted": "distortion by friction, backlash or steps of a sensor",
    "hum": "hum of the mains",
    "steps": "less than half a step of the sensor",
}


def _judged(found: dict[str, Any]) -> list[str]:
    """The part that was used, noise that is not the scatter between periods, and the invalid lines with reasons."""
    lines = []
    if (part := found.get("part")) is not None:
        end = "the end" if part["stop"] is None else f"sample {part['stop'] - 1}"
        lines.append(f"part of the recording: from sample {part['first']} to {end}")
    judged = found.get("judged", {})
    if moved := judged.get("noise_from_detection_lines"):
        lines.append(
            f"the schedule moves: noise of {counted(moved, 'response')} from detection lines (non-excited bins)"
        )
    if at := judged.get("not_repeating_hz"):
        where = ", ".join(f"{f:g}" for f in at[:_LINES_SHOWN]) + " …" * (len(at) > _LINES_SHOWN)
        lines.append(f"not valid in most windows at {where} Hz: the input does not repeat (see events.jsonl)")
    for kind, frequency_hz in judged.get("invalid_lines_hz", {}).items():
        where = ", ".join(f"{f:g}" for f in frequency_hz)
        lines.append(f"not valid at {where} Hz: {_REASONS[kind]} (see events.jsonl)")
    return lines


def tracked_amount(summary: dict[str, Any]) -> str:
    """One line with the amount of data tracked."""
    counts, speed, found = (summary[part] for part in ("counts", "speed", "found"))
    invalid = f", {counts['invalid_responses']} of them with an invalid line" if counts["invalid_responses"] else ""
    gaps = f", {counted(counts['gaps'], 'gap')}" if counts["gaps"] else ""
    return (
        f"{counted(counts['responses'], 'response')} at {counted(len(found['frequency_hz']), 'line')}{invalid}, "
        f"from {counts['samples']} samples{gaps}, one in {counted(found['hop'], 'sample')} "
        f"({found['rate_hz'] / found['hop']:.4g}/s): "
        f"{speed['recorded_s']:.1f} s of machine tracked in {speed['run_s']:.2f} s"
    )


def _show_moving(model: dict[str, Any]) -> None:
    """Print the model of the newest chunk of an axis in motion."""
    at, stiffness, damping = model["position_m"], model["stiffness_n_per_m"], model["damping_n_s_per_m"]
    print(
        f"\naxis in motion, newest chunk: motor inertia {model['inertia_kg_m2']:.5g} kg m², load mass "
        f"{model['load_kg']:.5g} kg, belt stiffness {stiffness[0]:.4g} … {stiffness[-1]:.4g} N/m and belt damping "
        f"{damping[0]:.4g} … {damping[-1]:.4g} N s/m from {at[0]:.4g} to {at[-1]:.4g} m"
    )


def _show_loop(found: dict[str, Any]) -> None:
    """Print the worst margins in one line."""
    if not (worst := found["worst_over_places"]):
        print(f"no margins: {found['message']}")
        return
    print(f"margins, worst of {counted(found['places'], 'fit')} over the run: {margins_in_short(worst)}")


def margins_in_short(worst: dict[str, float]) -> str:
    """The worst value of each margin, as `margins.worst` returns them, in one line."""
    return (
        f"gain {worst['gain_margin']:.3g} dB, phase {worst['phase_margin']:.3g}°, delay "
        f"{worst['delay_margin']:.3g} ms, Ms {worst['peak_sensitivity']:.3g}, bandwidth {worst['bandwidth']:.3g} Hz"
    )


def show_monitoring(found: dict[str, Any]) -> None:
    for sentence in found.get("alarms", [])[:_ALARMS_SHOWN]:
        print(sentence)
    if (more := len(found.get("alarms", [])) - _ALARMS_SHOWN) > 0:
        print(f"and {counted(more, 'alarm')} more in events.jsonl")
    print(found["message"])


def _show_statuses(summary: dict[str, Any]) -> None:
    """Print the numbers of valid and rejected fits, with reasons."""
    others = {word: count for word, count in summary["statuses"].items() if word not in ("ok", _NO_RESPONSE)}
    why = "".join(f"; {count} rejected: {word}" for word, count in others.items())
    if (count := summary["statuses"].get(_NO_RESPONSE)) is not None:
        why += f"; {counted(count, 'response')} not valid, so without a fit"
    print(f"\n{counted(summary['statuses'].get('ok', 0), 'fit')} of the {summary['model']} model valid{why}")
    if summary["unknown_gain"]:
        print(f"  {summary['unknown_gain']}")


def show_fit(found: Fit, of: str) -> None:
    """Print the fitted parameters with bounds."""
    low, high = found.band_hz
    print(f"{found.model.name} model, {of}; {counted(found.lines, 'line')}, {low:g} … {high:g} Hz")
    if found.status != "ok":
        print(f"  no parameters ({found.status}): {found.sentence}")
        return
    for name, value, bound, unit in found.rows():
        words = _with_symbol(name)
        if (limit := found.at_most(name)) is not None:
            print(f"  {words:28}{'≤':>3}{limit:>9.2g}   {'':12}{unit}")
            continue
        text, half = with_bound(value, bound)
        around = f"± {half:<12}" if bound else f"{half:14}"
        print(f"  {words:28}{text:>12} {around}{unit}")
    chi2 = "" if isnan(found.chi2) else f"; reduced chi² {found.chi2:.3g} from sigma alone"
    print(f"  {found.about_bounds}")
    print(f"  model error ε = {100 * found.epsilon:.2g} % of |G|{chi2}")


def _with_symbol(name: str) -> str:
    """The words for a quantity, with the symbol that options and files have for it."""
    return f"{quantity_name(name)} {name}" if name in QUANTITY_NAMES else quantity_name(name)


def show_poles(found: CommonPoles) -> None:
    """Print modes, poles and the weights at each output with bounds."""
    f, outputs = found.grid.frequency_hz, counted(len(found.outputs), "output")
    print(f"{found.model} model of {outputs}; {counted(f.size, 'line')}, {f[0]:g} … {f[-1]:g} Hz")
    if found.status != "ok":
        print(f"  no parameters ({found.status}): {found.sentence}")
        return
    print(f"  {found.about_order}")
    for name, value, bound, unit in found.rows():
        text, half = with_bound(value, bound)
        print(f"  {_with_symbol(name):28}{text:>12} ± {half:<12}{unit}")
    print(f"  {found.about_bounds}")
    for name, epsilon, chi2 in zip(found.outputs, found.epsilon, found.chi2):
        words = "" if isnan(chi2) else f"; reduced chi² {chi2:.3g} from sigma alone"
        print(f"  {name}: model error ε = {100 * epsilon:.2g} % of |G|{words}")
