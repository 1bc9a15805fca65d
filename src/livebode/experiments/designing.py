"""From the description of an experiment to a directory with the excitation, its picture and its axis.toml."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from livebode.configuration import axis_schema
from livebode.core import UsageError, install_command, whole_directory, writing
from livebode.experiment_design import FORMATS, Design, axis_text, choose, write
from livebode.experiments.design_directory import AXIS, MARK, SCHEMA, check_free, check_names, remove_design
from livebode.experiments.experiment import Experiment
from livebode.records import to_json
from livebode.structured_text import PERIOD_MAX

Picture = Callable[[Design, Path], None]


@dataclass(frozen=True)
class Designed:
    """Result of a design.

    Attributes
    ----------
    design
        The experiment.
    directory, files
        Its location.
    left_out
        Sentences on the formats that were not written by default, one a line; empty if there are none.
    """

    design: Design
    directory: Path
    files: tuple[str, ...]
    left_out: str = ""


def design_experiment(
    experiment: Experiment,
    directory: Path,
    *,
    name: str = "excitation",
    suffixes: Sequence[str] | None = None,
    force: bool = False,
    draw: Picture | None = None,
) -> Designed:
    """Design the experiment, and write its files to a new directory, which appears when it is complete.

    Raises
    ------
    DesignError
        If there is no solution (see `choose`).
    UsageError
        If a format is not supported or does not allow the name.
    ConfigError
        If the name of the recording is invalid.
    OutputError
        If the directory exists and must not be replaced, or the disk reports an error. Nothing is written then.
    """
    kinds = None if suffixes is None else tuple(f".{s.lstrip('.').lower()}" for s in suffixes)
    for kind in kinds or ():
        if kind not in FORMATS:
            raise UsageError(
                "not-one-of",
                f"the format {kind!r} is not supported",
                f"choose {', '.join(FORMATS)}",
                argument="suffixes",
                value=kind,
                allowed=list(FORMATS),
            )
    check_names(name, experiment.log)
    check_free(directory, force)
    design = choose(experiment.spec(), experiment.machine(), experiment.machine_limits())
    lines = design.waveform.lines
    left_out = {} if kinds else _without(lines.window)
    with writing(directory), whole_directory(directory, remove_design) as partial:
        for kind in kinds or (kind for kind in FORMATS if kind not in left_out):
            write(partial / f"{name}{kind}", design.waveform, name)
        configuration = axis_text(
            design,
            signals=experiment.signal_names(),
            log=experiment.log,
            loop=experiment.loop_tables(),
            motion=experiment.motion_table(lines.window / lines.rate_hz),
            tracking=experiment.tracking(),
        )
        (partial / AXIS).write_text(f"#:schema ./{SCHEMA}\n{configuration}", encoding="utf-8")
        (partial / SCHEMA).write_text(to_json(axis_schema(), indent=2) + "\n", encoding="utf-8")
        if draw is not None:
            draw(design, partial / f"{name}.png")
        files = tuple(sorted([*(path.name for path in partial.iterdir()), MARK]))
        facts = {"files": files} | design.plain()
        (partial / MARK).write_text(to_json(facts, indent=1) + "\n", encoding="utf-8")
        check_free(directory, force)
    return Designed(design, directory, files, "\n".join(left_out.values()))


def _without(window: int) -> dict[str, str]:
    """The formats that are not possible here, with the reason."""
    reasons = {}
    if find_spec("scipy") is None:
        reasons[".mat"] = f"no .mat, because SciPy is not installed; run {install_command('analysis')}"
    if window > PERIOD_MAX:
        reasons[".st"] = f"no .st: its {window} samples are more than the {PERIOD_MAX} of a PLC's table"
    return reasons
