"""From the description of a machine with several motors to a directory with its experiments and its axis.toml."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from livebode.configuration import axis_schema
from livebode.core import UsageError, whole_directory, writing
from livebode.mimo import MatrixDesign, choose_matrix
from livebode.records import to_json
from livebode_design.design_directory import AXIS, MARK, SCHEMA, check_free, check_names, remove_design
from livebode_design.matrix.matrix_experiment import MatrixExperiment
from livebode_design.matrix.matrix_files import MATRIX_FORMATS

Picture = Callable[[MatrixDesign, Path], None]


@dataclass(frozen=True)
class DesignedMatrix:
    """Result of a design for several inputs: the experiments, and the location of their files."""

    design: MatrixDesign
    directory: Path
    files: tuple[str, ...]


def design_matrix(
    experiment: MatrixExperiment,
    directory: Path,
    *,
    name: str = "excitation",
    suffixes: Sequence[str] | None = None,
    force: bool = False,
    draw: Picture | None = None,
) -> DesignedMatrix:
    """Design the experiments, and write their files to a new directory, which appears when it is complete.

    Raises
    ------
    DesignError
        If there is no solution (see `choose_matrix`).
    UsageError
        If a format is not supported or does not allow the name.
    ConfigError
        If the name of the recording is invalid.
    OutputError
        If the directory exists and must not be replaced, or the disk reports an error. Nothing is written then.
    """
    kinds = [*MATRIX_FORMATS] if suffixes is None else [f".{s.lstrip('.').lower()}" for s in suffixes]
    for kind in kinds:
        if kind not in MATRIX_FORMATS:
            raise UsageError(
                "not-one-of",
                f"the format {kind!r} is not supported for several inputs",
                f"choose {', '.join(MATRIX_FORMATS)}",
                argument="suffixes",
                value=kind,
                allowed=list(MATRIX_FORMATS),
            )
    check_names(name, experiment.log)
    check_free(directory, force)
    design = choose_matrix(experiment.spec(), experiment.machine(), experiment.machine_limits())
    text = matrix_axis_text(design, experiment.log, experiment.loop_tables(design.machine))
    with writing(directory), whole_directory(directory, remove_design) as partial:
        for kind in kinds:
            MATRIX_FORMATS[kind](partial / f"{name}{kind}", design, name)
        (partial / AXIS).write_text(text, encoding="utf-8")
        (partial / SCHEMA).write_text(to_json(axis_schema(), indent=2) + "\n", encoding="utf-8")
        if draw is not None:
            draw(design, partial / f"{name}.png")
        files = tuple(sorted([*(path.name for path in partial.iterdir()), MARK]))
        (partial / MARK).write_text(to_json({"files": files} | design.plain(), indent=1) + "\n", encoding="utf-8")
        check_free(directory, force)
    return DesignedMatrix(design, directory, files)


def matrix_axis_text(design: MatrixDesign, log: str, loop: Mapping[str, Any]) -> str:
    """The configuration with which `livebode run` tracks a recording that begins with the first experiment."""
    used = design.excitation
    tables: dict[str, Any] = {
        "source": {"log": log},
        "signals": {
            "output": list(design.outputs),
            "input": list(design.inputs),
            "excitation": list(design.excitations),
        },
        "lines": {"frequencies": used.lines.text, "window": used.lines.window},
        "tracking": {"estimator": "joint", "average": True, "hop": used.lines.window},
        "experiments": {
            "number": len(used.spectra),
            "dwell_periods": used.dwell,
            "settle_periods": used.settle,
            "memory": design.repetitions,
        },
        "loop": loop,
    }
    head = (
        f"#:schema ./{SCHEMA}\n# Written by `livebode design`; play the experiments {design.repetitions} times, "
        f"{design.time_s:.4g} s, and record from the first sample on.\n\n"
    )
    return head + tomli_w.dumps(tables)
