"""From the description of an experiment to a directory with the excitation, its picture and its axis.toml."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from livebode.configuration import axis_schema, kind_of_file, read_table
from livebode.core import ConfigError, UsageError, install_command, whole_directory, writing
from livebode.plugins import loaded, named
from livebode.records import to_json
from livebode_design.design_directory import AXIS, MARK, SCHEMA, check_free, check_names, remove_design


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

    formats: Sequence[str]
    terminal: str
    picture: str

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
class Designed(Generic[D]):
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
) -> Designed[D]:
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
    check_names(name, experiment.log)
    check_free(directory, force)
    design = experiment.design()
    left_out = {} if kinds else _without_scipy() | experiment.left_out(design)
    with writing(directory), whole_directory(directory, remove_design) as partial:
        for kind in kinds or (kind for kind in experiment.formats if kind not in left_out):
            experiment.write(partial / f"{name}{kind}", design, name)
        (partial / AXIS).write_text(f"#:schema ./{SCHEMA}\n{experiment.axis_text(design)}", encoding="utf-8")
        (partial / SCHEMA).write_text(to_json(axis_schema(), indent=2) + "\n", encoding="utf-8")
        if draw is not None:
            draw(design, partial / f"{name}.png")
        files = tuple(sorted([*(path.name for path in partial.iterdir()), MARK]))
        facts = {"files": files} | design.plain()
        (partial / MARK).write_text(to_json(facts, indent=1) + "\n", encoding="utf-8")
        check_free(directory, force)
    return Designed(design, directory, files, "\n".join(left_out.values()))


def _without_scipy() -> dict[str, str]:
    if find_spec("scipy") is not None:
        return {}
    return {".mat": f"no .mat, because SciPy is not installed; run {install_command('analysis')}"}


def described(experiment: str | PathLike[str] | Mapping[str, Any], over: Mapping[str, Any]) -> DescribedExperiment[Any]:
    """The experiment in a TOML file, or in the same as a mapping; `over` replaces keys of its [excitation]."""
    table = experiment if isinstance(experiment, Mapping) else read_table(Path(experiment))
    model: Any = loaded((kind_of_file(table) or named("files")["experiment"]).model)
    found: DescribedExperiment[Any]
    if not isinstance(experiment, Mapping):
        found = model.read(Path(experiment), over)
        return found
    required = experiment.get("excitation")
    if not isinstance(required, Mapping):
        raise ConfigError("key-missing", "'excitation' is missing", "add it, with the band", key="excitation")
    found = model.of({**experiment, "excitation": {**required, **over}}, "the description")
    return found


def design_described(
    experiment: str | PathLike[str] | Mapping[str, Any], directory: Path | None, over: Mapping[str, Any]
) -> AnyDesign:
    """The design of what is `described`; its files are written to `directory`, in every format; None: nothing is."""
    found = described(experiment, over)
    return found.design() if directory is None else design_experiment(found, directory).design
