"""From the description of an experiment to a directory with the excitation, its picture and its axis.toml."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from livebode.configuration import axis_schema, kind_of_file, read_table
from livebode.core import (
    ConfigError,
    OutputError,
    UsageError,
    install_command,
    remove_empty,
    remove_files,
    whole_directory,
    writing,
)
from livebode.dataclass import dataclass
from livebode.plugins import loaded
from livebode.records import to_json
from livebode_design.file_kinds import FILES
from livebode_design.files import FORMATS

_MARK, _AXIS, _SCHEMA = "design.json", "axis.toml", "axis.schema.json"


class AnyDesign(Protocol):
    """What a design is for its directory."""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        ...


D = TypeVar("D", bound=AnyDesign)


class DescribedExperiment(Protocol[D]):
    """An experiment as a file describes it: `Experiment`, `MatrixExperiment`; its kind has a row in `FILES`.

    Attributes
    ----------
    log
        Name of the recording.
    formats
        Suffixes of the files of an excitation.
    terminal, picture
        "module:name" of what prints a design, and of what draws it to a file.
    """

    formats: ClassVar[Sequence[str]]
    terminal: ClassVar[str]
    picture: ClassVar[str]

    @property
    def log(self) -> str: ...

    def design(self) -> D:
        """The experiment within the limits of the machine."""
        ...

    def axis_text(self, design: D) -> str:
        """The axis.toml with which a recording is tracked."""
        ...

    def write(self, path: Path, design: D, name: str) -> None:
        """Write the excitation in the format of the suffix."""
        ...

    def left_out(self, design: D) -> dict[str, str]:
        """The formats that are not possible for a design, with the reason."""
        ...


@dataclass(frozen=True)
class DesignFiles(Generic[D]):
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

    design: D
    directory: Path
    files: tuple[str, ...]
    left_out: str = ""


def design_experiment(
    experiment: DescribedExperiment[D],
    directory: Path,
    *,
    name: str = "excitation",
    suffixes: Sequence[str] | None = None,
    force: bool = False,
    draw: Callable[[D, Path], object] | None = None,
) -> DesignFiles[D]:
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
        if kind not in experiment.formats:
            raise UsageError(
                "not-one-of",
                f"the format {kind!r} is not supported",
                f"choose {', '.join(experiment.formats)}",
                argument="suffixes",
                value=kind,
                allowed=list(experiment.formats),
            )
    _check_names(name, experiment.log)
    _check_free(directory, force)
    design = experiment.design()
    left_out = {} if kinds else _without_scipy() | experiment.left_out(design)
    with writing(directory), whole_directory(directory, _remove_design) as partial:
        for kind in kinds or (kind for kind in experiment.formats if kind not in left_out):
            experiment.write(partial / f"{name}{kind}", design, name)
        (partial / _AXIS).write_text(f"#:schema ./{_SCHEMA}\n{experiment.axis_text(design)}", encoding="utf-8")
        (partial / _SCHEMA).write_text(_schema_text(), encoding="utf-8")
        if draw is not None:
            draw(design, partial / f"{name}.svg")
        files = tuple(sorted([*(path.name for path in partial.iterdir()), _MARK]))
        facts = {"files": files} | design.plain()
        (partial / _MARK).write_text(to_json(facts, indent=1) + "\n", encoding="utf-8")
        _check_free(directory, force)
    return DesignFiles(design, directory, files, "\n".join(left_out.values()))


@cache
def _schema_text() -> str:
    return to_json(axis_schema(), indent=2) + "\n"


def _without_scipy() -> dict[str, str]:
    if find_spec("scipy") is not None:
        return {}
    reason = f"because SciPy is not installed; run {install_command('analysis')}"
    return {ending: f"no {ending}, {reason}" for ending in (".mat", ".wav")}


def described(experiment: str | PathLike[str] | Mapping[str, Any], over: Mapping[str, Any]) -> DescribedExperiment[Any]:
    """The experiment in a TOML file, or in the same as a mapping; `over` replaces keys of its [excitation]."""
    table = experiment if isinstance(experiment, Mapping) else read_table(Path(experiment))
    kind = kind_of_file(table)
    own = kind if kind is not None and kind in FILES.values() else FILES["experiment"]
    model: Any = loaded(own.model)
    specification: DescribedExperiment[Any]
    if not isinstance(experiment, Mapping):
        specification = model.read(Path(experiment), over)
        return specification
    required = experiment.get("excitation")
    if not isinstance(required, Mapping):
        raise ConfigError("key-missing", "'excitation' is missing", "add it, with the band", key="excitation")
    specification = model.of({**experiment, "excitation": {**required, **over}}, "the description")
    return specification


def design_described(
    experiment: str | PathLike[str] | Mapping[str, Any], directory: Path | None, over: Mapping[str, Any]
) -> AnyDesign:
    """The design of what is `described`; its files are written to `directory`, in every format; None: nothing is."""
    description = described(experiment, over)
    design: AnyDesign = description.design() if directory is None else design_experiment(description, directory).design
    return design


def _check_names(name: str, log: str) -> None:
    """UsageError or ConfigError if the excitation or the recording cannot have this name."""
    if not name.strip() or not name.isprintable() or name.startswith(".") or Path(name).name != name:
        raise UsageError(
            "invalid-name",
            f"{name!r} cannot be the name of a file",
            "choose letters, digits and underscores",
            argument="name",
            value=name,
        )
    if not log.isprintable() or not Path(log).name:
        raise ConfigError(
            "value-invalid",
            f"log = {log!r} cannot be the file of a recording",
            "specify one such as 'log.csv'",
            key="log",
            value=log,
        )
    if log in (_MARK, _AXIS, _SCHEMA, f"{name}.svg", *(f"{name}{kind}" for kind in FORMATS)):
        raise ConfigError(
            "key-conflict",
            f"log = {log!r} is a file of the design",
            "give the recording another name",
            key="log",
            value=log,
        )


def _check_free(directory: Path, force: bool) -> None:
    """OutputError if the directory exists and must not be replaced."""
    if not (directory.exists() or directory.is_symlink()):
        return
    if not force:
        raise OutputError(
            "exists",
            f"{str(directory)!r} exists already",
            "choose another directory, or replace it with force",
            path=str(directory),
        )
    own = set() if directory.is_symlink() else _left_by(directory)
    if not own:
        raise OutputError(
            "not-replaceable",
            f"{str(directory)!r} is not the directory of an earlier design",
            "choose another directory",
            path=str(directory),
        )
    if others := sorted(
        path.name for path in directory.iterdir() if path.name not in own or path.is_symlink() or not path.is_file()
    ):
        raise OutputError(
            "not-replaceable",
            f"{str(directory)!r} also contains {others[0]!r}, which is not from a design",
            "move it, or choose another directory",
            path=str(directory),
            name=others[0],
        )


def _remove_design(directory: Path) -> None:
    """Remove the files of an earlier design, and the directory if it is then empty; OSError if it is not."""
    remove_files(directory, sorted(_left_by(directory), key=lambda name: name == _MARK))
    remove_empty(directory)


def _left_by(directory: Path) -> set[str]:
    """The files that design.json lists; none if it is not that of a design."""
    mark = directory / _MARK
    if mark.is_symlink() or not mark.is_file():
        return set()
    try:
        listed = json.loads(mark.read_text(encoding="utf-8"))["files"]
        names = {name for name in listed if isinstance(name, str)}
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    excitations = names - {_MARK, _AXIS, _SCHEMA}
    single = len({Path(name).stem for name in excitations}) == 1
    plain = all(Path(name).suffix in (*FORMATS, ".svg") and Path(name).name == name for name in excitations)
    return names if single and plain and len(names - excitations) == 3 else set()
