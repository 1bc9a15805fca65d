"""Subject: the configuration and the run that are examined."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from livebode.configuration import (
    Axis,
    FileKind,
    axes_of,
    kind_of_file,
    parse_table,
    read_bytes,
    recorded_configuration,
)
from livebode.core import ConfigError, LivebodeError, UsageError
from livebode.dataclass import dataclass
from livebode.estimates import rule
from livebode.plugins import loaded
from livebode.records import RunRecord


@dataclass(frozen=True)
class Subject:
    """What is examined beside the computer.

    Attributes
    ----------
    configuration
        The file of axes or of another kind; None where none was given.
    table
        What is in it, as plain data; None where it is not TOML.
    kind
        The kind of the file; None for axes.
    axes
        The axes in it, else that of the run; empty where they cannot be used.
    run
        The run; None where none was given, or it cannot be read.
    run_path
        Its directory, where one was given.
    problems
        Why configuration and run cannot be used, by "configuration" and "run".
    """

    configuration: Path | None = None
    table: Mapping[str, Any] | None = None
    kind: FileKind | None = None
    axes: Mapping[str, Axis] = field(default_factory=dict)
    run: RunRecord | None = None
    run_path: Path | None = None
    problems: Mapping[str, LivebodeError] = field(default_factory=dict)

    @property
    def sourced(self) -> Mapping[str, Axis]:
        """The axes whose sources are still needed: those of a finished run are not."""
        ended = self.configuration is None and self.run is not None and self.run.finished
        return {} if ended else self.axes

    @classmethod
    def of(cls, paths: Sequence[Path]) -> Subject:
        """From a TOML file, the directory of a run, both, or neither.

        Raises
        ------
        UsageError
            If there are two of a kind.
        """
        files = [path for path in paths if path.suffix.lower() == ".toml"]
        runs = [path for path in paths if path not in files]
        for given, kind in ((files, "configurations"), (runs, "runs")):
            if len(given) > 1:
                raise UsageError("too-many", f"{len(given)} {kind} are given", "give one of them", argument="targets")
        return _read(files[0] if files else None, runs[0] if runs else None)


def _read(configuration: Path | None, run_path: Path | None) -> Subject:
    problems: dict[str, LivebodeError] = {}
    table: Mapping[str, Any] | None = None
    axes: Mapping[str, Axis] = {}
    run: RunRecord | None = None
    kind: FileKind | None = None
    if run_path is not None:
        try:
            run = RunRecord.open(run_path, on_damage=lambda _: None, matrix=True)
            if configuration is None:
                axes = {"": Axis.of(recorded_configuration(run.summary), str(run_path))}
        except LivebodeError as error:
            problems["run"] = error
    if configuration is not None:
        try:
            data = read_bytes(configuration)
            table = parse_table(data, str(configuration))
            kind = kind_of_file(table)
            if kind is not None:
                loaded(kind.model).read(configuration).check()
            elif table.keys().isdisjoint(("source", "axes")):
                raise _without_source(configuration)
            else:
                axes = axes_of(data, configuration, {})
                _check_axes(axes, configuration)
        except LivebodeError as error:
            problems["configuration"] = error
    return Subject(configuration, table, kind, axes, run, run_path, problems)


def _without_source(path: Path) -> ConfigError:
    """The error of a recipe of an archive, of a template of reports, or of an unfinished axis.toml."""
    return ConfigError(
        "key-missing",
        "'source' is missing, so this is not a file that doctor checks",
        "add [source]; a recipe is checked with its archive.toml, and a template when a report uses it",
        key="source",
    ).at(str(path))


def _check_axes(axes: Mapping[str, Axis], path: Path) -> None:
    for name, axis in axes.items():
        if (error := _problem_of(axis)) is not None:
            raise error.at(f"{path}, axis {name}" if name else str(path))


def _problem_of(axis: Axis) -> LivebodeError | None:
    """Why it could not begin: its lines, loop or baseline; None where nothing is found, or it takes samples to tell."""
    try:
        if axis.monitoring.baseline is not None:
            rule(axis.kind, "baseline").load(axis.monitoring.baseline)
            if axis.monitoring.gantry is not None:
                rule(axis.kind, "machine")(axis.monitoring.gantry)
        if axis.source.url is not None and axis.source.rate_hz is not None:
            from livebode.preparation import live_follower

            live_follower(axis, axis.source.rate_hz)
    except LivebodeError as error:
        return error
    return None
