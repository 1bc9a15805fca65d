"""A baseline that was learned: its file, and what a person should know of it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.core import BaselineError, OutputError, counted

if TYPE_CHECKING:
    from livebode.monitoring import Baseline, LearnedMachine

_LATE_SAMPLES = 0.05  # less is not reported
_MACHINE = ("stiffness", "load", "damping", "inertia")


def check_replaceable(out: Path, reason: str | None, *, force: bool) -> None:
    """OutputError if there is a file, and neither a reason for a next version nor permission to replace it."""
    if out.exists() and not force and reason is None:
        raise OutputError(
            "exists",
            f"{str(out)!r} exists already",
            "replace it as its next version with --reason TEXT, or choose another --out",
            path=str(out),
        )


def write_baseline(learned: Baseline, out: Path, reason: str | None, *, force: bool) -> dict[str, Any]:
    """Write a baseline as the file's next version; what it is, for JSON and for `sentences`."""
    before = _previous(out, force=force)
    baseline = _saved(learned, before, out, reason or "")
    replaced = None if before is None or before.id == baseline.id else before.id
    named = {"baseline": str(out), "id": baseline.id, "replaces": replaced, "reason": baseline.reason}
    return named | _found(baseline) | {"file": _place(baseline, before, out)}


def _previous(out: Path, *, force: bool) -> Baseline | None:
    """The baseline in the file to be written; with `force` another file is replaced without a trace."""
    from livebode.monitoring import Baseline

    try:
        return Baseline.load(out) if out.exists() else None
    except BaselineError:
        if not force:
            raise
        return None


def _saved(learned: Baseline, before: Baseline | None, out: Path, reason: str) -> Baseline:
    if before is not None:
        return learned.save_version(out, reason)
    first = replace(learned, reason=reason)
    first.save(out)
    return first


def _place(baseline: Baseline, before: Baseline | None, out: Path) -> str:
    from livebode.monitoring import retained_file

    if before is None:
        return f"{out}, version {baseline.id}"
    if before.id == baseline.id:
        return f"{out}, version {baseline.id}, is unchanged: what was learned is the same"
    return f"{out}, version {baseline.id}; the previous one is retained as {retained_file(out, before.id)}"


def _found(baseline: Baseline) -> dict[str, Any]:
    from livebode.monitoring import PLACES, STILL

    table, machine = baseline.tables[0], baseline.machine
    at_standstill = baseline.signals["schedule"] is not None and table.count.sum() == table.count[:, STILL].sum()
    coarse = len(baseline.places) < PLACES and not at_standstill
    cells = int((table.count > 0).sum())
    found: dict[str, Any] = {
        "runs": list(baseline.runs),
        "windows": int(table.count.sum()),
        "cells": cells,
        "parameters": [name for other in baseline.tables[1:] for name in other.names],
        "lines_from_percent": [round(100 * float(x), 2) for x in table.accuracy.smallest[0::2]],
        "hop": baseline.hop,
        "hop_at_most": baseline.lines.window // PLACES if coarse else None,
        "model": None,
        "remark": baseline.remark,
        "torque": None if baseline.torque is None else baseline.torque.smallest,
        "torque_remark": baseline.torque_remark,
    }
    if machine is not None:
        found["model"] = {
            "from": machine.model.low_m,
            "to": machine.model.high_m,
            "slowest": machine.slowest_m_per_s,
            "fastest": machine.fastest_m_per_s,
            "ripple_cycles_per_m": machine.ripple.cycles_per_m.round(2).tolist(),
            "ripple_n_m": machine.ripple.peak_n_m.round(6).tolist(),
            "delay_samples": round(machine.delay_s * baseline.lines.rate_hz, 3),
            "covariates": _covariates(machine),
            "between_runs_percent": _between_runs(machine),
            "changes_from_percent": dict(zip(_MACHINE, (100 * machine.held.smallest).round(2).tolist())),
        }
    return found


def baseline_text(found: dict[str, Any]) -> str:
    """What was learned, and which changes it detects."""
    cells = f"{counted(found['cells'], 'cell')} of the schedule"
    text = f"Learned from {found['windows']} windows in {cells}."
    if (model := found["model"]) is None:
        least, most = min(found["lines_from_percent"]), max(found["lines_from_percent"])
        sizes = f"{least:g} %" if least == most else f"{least:g} to {most:g} %, line by line"
        watched = "Lines and fitted parameters" if found["parameters"] else "Only lines"
        return (
            f"{text} No model of the moving machine: {found['remark']}. {watched} are monitored; "
            f"the smallest change that a line detects is {sizes}.{_coarse(found)}{_friction(found)}"
        )
    changes = ", ".join(f"{name} {percent:g} %" for name, percent in model["changes_from_percent"].items())
    way, speeds = _between(model["from"], model["to"]), _between(model["slowest"], model["fastest"])
    return (
        f"{text}\nThe model of the machine covers positions {way} at speeds {speeds} per second. Smallest changes that "
        f"it detects: {changes}.{_ripple(model)}{_dependence(model)}{_friction(found)}"
    )


def _friction(found: dict[str, Any]) -> str:
    """From which changes on friction and orders are monitored, or why not."""
    if (torque := found["torque"]) is None:
        return f"\nFriction and orders are not monitored: {found['torque_remark']}." if found["torque_remark"] else ""
    sizes = torque["friction_percent"].values()
    text = f"\nFriction is monitored; the smallest change that it detects is {_range(sizes, '%')}."
    if orders := torque["orders"]:
        sizes = _range(orders.values(), torque["unit"])
        text += f" So are the orders; one is reported from an amplitude of {sizes} on."
    return text


def _range(sizes: Collection[float], unit: str) -> str:
    low, high = (f"{size:.2g}" for size in (min(sizes), max(sizes)))
    return f"{low} {unit}".rstrip() if low == high else f"{low} to {high} {unit}".rstrip()


def _ripple(model: dict[str, Any]) -> str:
    """Torque ripple and delay of the model, if any."""
    text, late = "", model["delay_samples"]
    if model["ripple_n_m"]:
        pairs = zip(model["ripple_cycles_per_m"], model["ripple_n_m"])
        orders = ", ".join(f"{_torque(torque)} at {order:.4g} cycles" for order, torque in pairs)
        text += f"\nTorque ripple over the position: {orders} per metre. The model contains it."
    if abs(late) >= _LATE_SAMPLES:
        text += f"\nThe output is {late:.2f} samples late relative to the torque. The model contains this delay."
    return text


def _torque(peak_n_m: float) -> str:
    return f"{peak_n_m:.2g} N m" if peak_n_m > 0 else "an amplitude that no stroke away from the lines shows"


def _covariates(machine: LearnedMachine) -> list[dict[str, Any]]:
    """Range of each covariate, and its influence in percent per unit."""
    c = machine.covariates
    return [
        {"name": name, "from": float(low), "to": float(high), "percent_per_unit": dict(zip(_MACHINE, slope.tolist()))}
        for name, low, high, slope in zip(c.names, c.low, c.high, (100 * c.slope.T).round(4))
    ]


def _between_runs(machine: LearnedMachine) -> dict[str, float]:
    """Standard deviation between healthy runs, in percent; empty if they do not differ."""
    if (between := machine.between) is None:
        return {}
    seen = between.dominant(machine.held.smallest)
    percent = (100 * between.spread * abs(between.direction)).round(2).tolist()
    return {name: size for name, size, part in zip(_MACHINE, percent, seen) if part}


def _dependence(model: dict[str, Any]) -> str:
    """Covariates of the model, and differences between the runs without a known reason."""
    text = ""
    for c in model["covariates"]:
        slopes = ", ".join(f"{what} {percent:+.3g} %" for what, percent in c["percent_per_unit"].items())
        way = _between(c["from"], c["to"])
        text += f"\nPer unit of {c['name']} (learned {way}): {slopes}. Windows outside this range are not judged."
    if differ := model["between_runs_percent"]:
        sizes = ", ".join(f"{what} by {percent:g} %" for what, percent in differ.items())
        text += (
            f"\nThe runs differ from each other: {sizes} (standard deviation). A change of this kind is detected if it "
            "occurs within a run; one that is present from the start is detected only beyond three times this size. "
            "If a temperature explains the difference, add its channel to [monitoring] covariates of the runs."
        )
    return text


def _coarse(found: dict[str, Any]) -> str:
    if (most := found["hop_at_most"]) is None:
        return ""
    return (
        f"\nA hop of {found['hop']} samples is too coarse for the effect of motion on the responses: learn with a hop "
        f"of {most} or less, or use this baseline only at standstill or for recordings that begin at the same phase "
        "of the excitation's period."
    )


def _between(low: float, high: float) -> str:
    one, other = f"{low:.3g}", f"{high:.3g}"
    return f"of {one}" if one == other else f"from {one} to {other}"
