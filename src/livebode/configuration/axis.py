"""Axis: configuration of one machine as plain data, read from TOML and validated completely before the start."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

from livebode.configuration.fit_section import FitSection
from livebode.configuration.loop_section import LoopSection
from livebode.configuration.machine_sections import MachineSection, MonitoringSection, OrdersSection
from livebode.configuration.measurement_sections import (
    ExperimentsSection,
    LinesSection,
    MotionSection,
    OutputOnlySection,
    SignalsSection,
    TrackingSection,
)
from livebode.configuration.output_sections import RecordSection, ServeSection
from livebode.configuration.publish_section import PublishSection, check_publish
from livebode.configuration.ready import ReadyCondition, ready_condition
from livebode.configuration.report_section import ReportSection, report_error
from livebode.configuration.section import ConfigurationSection
from livebode.configuration.toml_file import one_line, read_table, shortened
from livebode.core import ConfigError, Field, TypedTable, errors_of, nearest_name
from livebode.estimates import MATRIX, RESPONSE, rule
from livebode.sources import live
from livebode.sources.live import SourceSettings

NOT_RECORDED = {"serve", "publish"}
"""Sections that are about this computer and its network, and change no result: run.json has none of them."""
SINKS_MAX = 32
_UNION = {"int", "str", "constrained-int", "constrained-str"}
MAY_BE_SECRET = {
    *("url", "username", "password_env", "password_file"),
    *("token_env", "token_file", "viewer_token_env", "viewer_token_file"),
    *("url_env", "url_file", "secret_env", "secret_file"),
}


class Axis(ConfigurationSection):
    """One machine: its source, signals, lines, tracking and loop.

    Parameters
    ----------
    source
        The recording, or the live source.
    signals
        Names of the channels.
    lines
        The excited frequencies and the window.
    tracking
        How responses and their bounds are estimated.
    experiments
        The experiments that separate the inputs of a matrix of responses.
    loop
        The controllers, the injection point of the excitation, and the times at which signals are logged.
    record
        The run is recorded in segments that survive a kill.
    motion
        The effect of the axis's motion is removed from the responses.
    fit
        A model is fitted to every response.
    output_only
        The modes are tracked from the output alone.
    orders
        Shafts, and the torque that repeats with their angle.
    monitoring
        Comparison with a baseline.
    serve
        Address of the dashboard, and access to it.
    report
        The first page of the report, and the limits that the machine must meet.
    machine
        Which machine it is.
    publish
        Receivers of events and results.
    """

    source: SourceSettings
    signals: SignalsSection
    lines: LinesSection = LinesSection()
    tracking: TrackingSection = TrackingSection()
    experiments: ExperimentsSection | None = None
    loop: LoopSection = LoopSection()
    record: RecordSection | None = None
    motion: MotionSection | None = None
    fit: FitSection | None = None
    output_only: OutputOnlySection | None = None
    orders: OrdersSection = OrdersSection()
    monitoring: MonitoringSection = MonitoringSection()
    serve: ServeSection = ServeSection()
    report: ReportSection | None = None
    machine: MachineSection | None = None
    publish: Annotated[list[PublishSection], Field(max_length=SINKS_MAX)] = []

    @classmethod
    def read(cls, path: Path) -> Axis:
        """The Axis in a TOML file.

        Raises
        ------
        ConfigError
            If the file cannot be read, is not TOML, or has an unknown key or a value out of range; the message gives
            the key, the value and what is allowed.
        SourceError
            If the address of the source is invalid.
        """
        return cls.of(read_table(path), str(path)).beside(path.parent)

    @classmethod
    def of(cls, data: dict[str, Any], origin: str) -> Axis:
        """The Axis in plain data; `origin` names it in messages."""
        try:
            axis = cls.model_validate(data)
        except ValueError as error:
            raise _first_of(error).at(origin) from None
        if sum(named is not None for named in (axis.source.log, axis.source.url, axis.source.replay)) != 1:
            raise ConfigError(
                "key-conflict",
                "[source] needs either a log, a url or a replay",
                "set source.log for a recording, source.url for a live source, or source.replay for a recorded one",
                key="source",
            ).at(origin)
        if len(axis.source.logs) > 1 and (keys := _of_one_recording(axis)):
            raise ConfigError(
                "key-conflict",
                f"{keys[0]} does not apply to several recordings in one run",
                "omit it, or track each recording in a run of its own",
                keys=["source.log", keys[0]],
            ).at(origin)
        if axis.source.url is not None:
            live.checked_address(axis.source.url, axis.source)
        if axis.source.replay is not None:
            live.check_keys(axis.source, "replay")
        try:
            if axis.signals.is_matrix:
                rule(MATRIX, "check")(axis)
            else:
                _check_no_matrix(axis.experiments, axis.loop, axis.monitoring)
            if axis.output_only is not None:
                from livebode.configuration.output_only import check_output_only

                check_output_only(axis)
            check_publish(axis.publish)
        except ConfigError as error:
            raise error.at(origin) from None
        return axis

    @property
    def kind(self) -> str:
        """The kind of its estimate, a key of `livebode.estimates.ESTIMATES`."""
        return "output_only" if self.output_only is not None else MATRIX if self.signals.is_matrix else RESPONSE

    @property
    def entries(self) -> list[tuple[str, str]]:
        """Output and input of each entry of a matrix of responses; none of an axis with one."""
        if not self.signals.is_matrix:
            return []
        columns = self.signals.listed("excitation" if self.tracking.estimator == "indirect" else "input")
        return [(output, column) for output in self.signals.listed("output") for column in columns]

    @property
    def ready(self) -> ReadyCondition | None:
        """At which samples the machine is ready; None without such a channel. ConfigError as `ready_condition`."""
        # An average of matrices has no window of a machine that was not ready.
        of, averages = self.monitoring, self.tracking.average and not self.signals.is_matrix
        return ready_condition(self.signals.ready, of.ready_mask, of.ready_value, averages=averages)

    def beside(self, folder: Path) -> Axis:
        """The same with relative paths from `folder`."""
        axis = self.model_copy(update={"source": self.source.beside(folder)})
        if "serve" in self.model_fields_set:
            axis = axis.model_copy(update={"serve": self.serve.beside(folder)})
        if self.publish:
            axis = axis.model_copy(update={"publish": [section.beside(folder) for section in self.publish]})
        if self.report is not None:
            axis = axis.model_copy(update={"report": self.report.beside(folder)})
        monitoring = axis.monitoring.beside(folder)
        # A section that nobody wrote stays one that nobody wrote.
        return axis if monitoring is axis.monitoring else axis.model_copy(update={"monitoring": monitoring})


class _ServeOnly(ConfigurationSection):
    """A file with nothing but [serve]."""

    serve: ServeSection


class _LoopOnly(ConfigurationSection):
    """A file with nothing but [loop]."""

    loop: LoopSection


def read_serve_section(path: Path) -> ServeSection:
    """[serve] of a configuration, or of a file that has only this section, as `livebode view` needs it.

    Raises
    ------
    ConfigError
        As of `Axis.read`.
    """
    return _with(path, _ServeOnly, "serve").serve.beside(path.parent)


def read_loop(path: Path) -> LoopSection:
    """[loop] of a configuration, or of a file that has only this section; errors as of `Axis.read`."""
    return _with(path, _LoopOnly, "loop").loop


Only = TypeVar("Only", bound=TypedTable)


def _with(path: Path, only: type[Only], name: str) -> Only | Axis:
    """A whole configuration, or a file that has only this section."""
    data = read_table(path)
    if set(data) != {name}:
        return Axis.of(data, str(path))
    try:
        return only.model_validate(data)
    except ValueError as error:
        raise _first_of(error).at(str(path)) from None


def _check_no_matrix(experiments: ExperimentsSection | None, loop: LoopSection, monitoring: MonitoringSection) -> None:
    """ConfigError if an axis with a single response sets what only a matrix has."""
    unused = ["experiments"] if experiments is not None else []
    if loop.controllers:
        unused.append("loop.controllers")
    if monitoring.gantry is not None:
        unused.append("monitoring.gantry")
    if unused:
        raise ConfigError(
            "key-conflict",
            f"{unused[0]} belongs to a matrix of responses, but [signals] names one output and one input",
            "remove it, or list several channels in signals.output or signals.input",
            key=unused[0],
        )


def _of_one_recording(axis: Axis) -> list[str]:
    """Keys that are set and need a single recording."""
    given = {
        "source.follow": axis.source.follow,
        "[record] (option --continue)": axis.record is not None,
        "[motion]": axis.motion is not None,
        "[output_only] (option --output-only)": axis.output_only is not None,
        "monitoring.baseline": axis.monitoring.baseline is not None,
        f"tracking.estimator {axis.tracking.estimator!r}": axis.tracking.estimator in ("lpm", "welch"),
    }
    return [key for key, there in given.items() if there]


def _first_of(error: ValueError) -> ConfigError:
    """The first error, with its key and value; missing keys last, because a misspelt key also causes a missing one."""
    from livebode.configuration.toml_mistakes import meant_value  # needed for a mistake only

    first = min(errors_of(error), key=_is_less_helpful)
    if first["loc"][:1] == ("report",):
        return report_error(first)
    # After a union, pydantic adds the name of the type that it tried.
    place = one_line(".".join(str(part) for part in first["loc"] if part not in _UNION and "[" not in str(part)))
    if first["type"] == "extra_forbidden":
        return ConfigError("key-unknown", f"there is no setting {place!r}", nearest(first["loc"]), key=place)
    if first["type"] == "missing":
        return ConfigError("key-missing", f"{place!r} is missing", "add it", key=place)
    secret = MAY_BE_SECRET & {str(part) for part in first["loc"]}
    value = "its value" if secret else shortened(first["input"])
    why = first["msg"].removeprefix("Value error, ").lower()
    facts = {"key": place} | ({} if secret else {"value": value})
    meant = None if secret else meant_value(first["type"], first["input"])
    remedy = "correct it" if meant is None else f"write {meant}"
    return ConfigError("value-invalid", f"{place} = {value} is not usable: {why}", remedy, **facts)


def _is_less_helpful(error: Mapping[str, Any]) -> tuple[bool, bool]:
    """Whether others are reported first: of a list that may also be a text, those on the list."""
    return error["type"] == "missing", error["type"] == "string_type" and isinstance(error["input"], list)


def nearest(loc: tuple[int | str, ...]) -> str:
    """Suggestion for an unknown key at this place of an axis: its section, if it is one, or the nearest key."""
    if loc[1:] and loc[-1] in Axis.model_fields:
        kind = _section_at((loc[-1],))
        return f"[{loc[-1]}] is a section of its own, with the settings {', '.join(_names(kind))}"
    owners = [f"[{name}]" for name in Axis.model_fields if loc[1:] and loc[-1] in _names(_section_at((name,)))]
    if owners:
        return f"it belongs to {' or '.join(owners)}: write it below that header"
    return nearest_name(str(loc[-1]), _names(_section_at(loc[:-1])), "Settings")


def _names(section: type[TypedTable]) -> list[str]:
    return [field.alias or name for name, field in section.model_fields.items()]


def _section_at(loc: tuple[int | str, ...]) -> type[TypedTable]:
    section: type[TypedTable] = Axis
    for part in (part for part in loc if isinstance(part, str)):
        annotation: Any = section.model_fields[part].annotation
        section = next(
            c
            for c in (annotation, *getattr(annotation, "__args__", ()))
            if isinstance(c, type) and issubclass(c, TypedTable)
        )
    return section
