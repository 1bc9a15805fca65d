"""From the description of an experiment to a directory with the excitation, its picture and its axis.toml."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any

from livebode.configuration import axis_schema
from livebode.core import ConfigError, UsageError, install_command, whole_directory, writing
from livebode.records import to_json
from livebode.structured_text import PERIOD_MAX
from livebode_design._choose import choose
from livebode_design.axis_file import axis_text
from livebode_design.design import Design
from livebode_design.design_directory import AXIS, MARK, SCHEMA, check_free, check_names, remove_design
from livebode_design.experiment import Experiment
from livebode_design.files import FORMATS, write

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


def design_described(
    experiment: str | PathLike[str] | Mapping[str, Any], directory: Path | None, over: Mapping[str, Any]
) -> Design:
    """The design of a TOML file or of the same as a mapping; `over` replaces keys of its [excitation].

    Its files are written to `directory`, in every format; None writes nothing.
    """
    described = _described(experiment, over)
    if directory is None:
        return choose(described.spec(), described.machine(), described.machine_limits())
    return design_experiment(described, directory).design


def _described(experiment: str | PathLike[str] | Mapping[str, Any], over: Mapping[str, Any]) -> Experiment:
    if not isinstance(experiment, Mapping):
        return Experiment.read(Path(experiment), over)
    required = experiment.get("excitation")
    if not isinstance(required, Mapping):
        raise ConfigError("key-missing", "'excitation' is missing", "add it, with the band", key="excitation")
    return Experiment.of({**experiment, "excitation": {**required, **over}}, "the description")
