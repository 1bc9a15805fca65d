"""How it was measured: source, signals, lines, window, estimator, loop."""

from __future__ import annotations

from typing import Any

from livebode.core.document import Paragraph, Section
from livebode.reporting.material import Material
from livebode.reporting.wording import duration, many, pairs

_ESTIMATOR = {
    "joint": "joint: S_wy/S_wu, unbiased in any linear loop",
    "direct": "direct: S_uy/S_uu, biased if y is fed back to u",
    "indirect": "indirect: response of the closed loop, from which the described controllers are removed",
}
_NOISE = {
    "periods": "the scatter between windows that are whole periods apart",
    "auto": "the scatter between windows that are whole periods apart; where the schedule moves, detection lines "
    "(non-excited bins)",
    "quiet": "detection lines (non-excited bins); at standstill the scatter between periods if it is larger",
}
_ROLES = {"excitation": "excitation w", "input": "plant input u", "output": "output y", "schedule": "schedule"}


def how(of: Material) -> Section:
    """The section "How it was measured"."""
    found, tracking = of.run.found, of.configuration.get("tracking", {})
    window_s = found["window"] / found["rate_hz"]
    f = of.run.lines.frequency_hz
    source = of.configuration.get("source", {})
    rows = [
        ("source", str(source.get("log") or source.get("url") or "")),
        ("format", str(found.get("format", ""))),
        *((_ROLES[role], of.channels[role]) for role in _ROLES if role in of.channels),
        ("rate", f"{found['rate_hz']:g} Hz" + (f" ({found['rate_from']})" if "rate_from" in found else "")),
        ("samples", f"{of.samples:,}, {duration(of.samples / found['rate_hz'])}"),
        ("quantity", f"{found['quantity']}, in {found['unit']}" if found["unit"] else f"{found['quantity']}, no unit"),
        ("lines", f"{many(len(f), 'line')}, {f[0]:g} … {f[-1]:g} Hz on a grid of {1 / window_s:.4g} Hz"),
        ("window", f"{found['window']} samples, {1000 * window_s:.4g} ms: a whole number of periods of each line"),
        ("hop", f"{found['hop']} samples, {found['rate_hz'] / found['hop']:.4g} responses/s" if "hop" in found else ""),
        ("estimator", _ESTIMATOR.get(tracking.get("estimator", ""), "")),
        ("bounds from", _NOISE.get(tracking.get("noise", ""), "")),
        ("options", ", ".join(_options(tracking, of))),
        ("loop", "; ".join(_loop(of.configuration.get("loop", {})))),
    ]
    bounds = (
        "The effective time of a response is the centre of its window. A bound contains the true response with the "
        "stated probability. It covers noise, and distortion where it is detected; "
        "it does not cover a systematic error that the signals do not show."
    )
    return Section("How it was measured", (pairs(rows), Paragraph(bounds)))


def _options(tracking: dict[str, Any], of: Material) -> list[str]:
    said = []
    if tracking.get("average"):
        said.append(f"averaged over periods with forgetting {tracking['forgetting']:g}")
    if tracking.get("differenced"):
        said.append(f"differenced: {', '.join(tracking['differenced'])}")
    if tracking.get("spikes"):
        said.append(f"windows with spikes of {', '.join(tracking['spikes'])} excluded")
    if tracking.get("hann"):
        said.append("Hann window")
    if tracking.get("dtype") == "float32":
        said.append("single precision")
    if "motion" in of.configuration:
        said.append("corrected for the axis's motion with a moving model")
    return said


def _loop(loop: dict[str, Any]) -> list[str]:
    """The described controllers in words; empty if there are none."""
    said = []
    for name in ("velocity", "position", "position_pd"):
        if name in loop:
            settings = ", ".join(f"{key} {value}" for key, value in loop[name].items() if value)
            said.append(f"{name.replace('_', ' ')}: {settings}")
    return [f"excitation at the {loop['excitation_at']}", *said] if said else []
