"""`livebode learn`: the healthy machine, from finished runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.cli.options import Json
from livebode.nouns import InputError
from livebode.records import to_json

if TYPE_CHECKING:
    from livebode.monitoring import Baseline

_MACHINE = ("stiffness", "load", "damping", "inertia")


def learn_command(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN…", help="Run directories of the healthy machine.")],
    out: Annotated[Path, typer.Option(metavar="BASELINE", help="File to write, JSON.")],
    force: Annotated[bool, typer.Option("--force", help="Replace a baseline there.")] = False,
    as_json: Json = False,
) -> None:
    """Learn what the healthy machine is like, for `livebode run --baseline`."""
    from rich.console import Console

    from livebode.session.learning import learn  # with the simulation

    if out.exists() and not force:
        raise InputError(f"{str(out)!r} exists already; take another --out, or --force to replace it")
    console = Console(stderr=True, highlight=False)
    with console.status("reading the runs", spinner="line") as status:
        baseline = learn(runs, say=status.update)
    baseline.save(out)
    found = _found(baseline)
    print(to_json({"baseline": str(out)} | found) if as_json else f"{_sentences(found)}\n{out}")


def _found(baseline: Baseline) -> dict[str, Any]:
    table, machine = baseline.tables[0], baseline.machine
    cells = int((table.count > 0).sum())
    found: dict[str, Any] = {
        "runs": list(baseline.runs),
        "windows": int(table.count.sum()),
        "cells": cells,
        "lines_from_percent": [round(100 * float(x), 2) for x in table.accuracy.smallest[0::2]],
        "model": None,
        "remark": baseline.remark,
    }
    if machine is not None:
        found["model"] = {
            "from": machine.model.low_m,
            "to": machine.model.high_m,
            "slowest": machine.slowest_m_per_s,
            "fastest": machine.fastest_m_per_s,
            "changes_from_percent": dict(zip(_MACHINE, (100 * machine.held.smallest).round(2).tolist())),
        }
    return found


def _sentences(found: dict[str, Any]) -> str:
    text = f"Learned from {found['windows']} windows in {found['cells']} cells of the schedule."
    if (model := found["model"]) is None:
        most = max(found["lines_from_percent"])
        return (
            f"{text} No model of the moving machine: {found['remark']}. Lines are watched alone, for changes from "
            + (f"{min(found['lines_from_percent']):g} to {most:g} % on, line by line.")
        )
    changes = ", ".join(f"{name} {percent:g} %" for name, percent in model["changes_from_percent"].items())
    return (
        f"{text}\nThe model of the machine knows the way from {model['from']:.3g} to {model['to']:.3g} at "
        f"{model['slowest']:.3g} to {model['fastest']:.3g} a second, and is good for changes from: {changes}."
    )
