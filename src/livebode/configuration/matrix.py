"""A matrix of responses: which keys of an axis belong to it, and its settings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pydantic import BaseModel

from livebode.core import ConfigError, Lines, Model

if TYPE_CHECKING:
    from livebode.configuration.axis import Axis
    from livebode.configuration.experiments_section import ExperimentsSection
    from livebode.configuration.loop_section import ControllerSection, LoopSection
    from livebode.configuration.monitoring_section import MonitoringSection
    from livebode.mimo import MatrixLoop, MatrixSettings

_USED = {
    "signals": {"outputs", "inputs", "excitations", "ready"},
    "lines": {"frequencies", "window"},
    "tracking": {"estimator", "hop", "average"},
    "monitoring": {"baseline", "false_alarm_interval_days", "gantry", "ready_mask", "ready_value"},
    "loop": {"input_logged", "excitation_logged", "output_logged", "controllers"},
}
_USED_WHOLE = {"source", "experiments", "record", "serve", "report", "machine", "publish"}
_OTHER_RUNS = ("fit", "motion", "output_only")
_ESTIMATORS = ("direct", "joint", "indirect")


def check_no_matrix(experiments: ExperimentsSection | None, loop: LoopSection, monitoring: MonitoringSection) -> None:
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


def check_matrix(axis: Axis) -> None:
    """ConfigError if an axis with lists of signals sets what only a single response has, or lists that do not fit."""
    _check_keys(axis)
    _check_signals(axis)
    if axis.lines.frequencies == "auto" or axis.lines.window == "auto":
        raise ConfigError(
            "incomplete",
            "a matrix of responses needs its lines and window, but one of them is 'auto'",
            "set lines.frequencies and lines.window to those of the excitation",
            key="lines",
        )


def _check_keys(axis: Axis) -> None:
    unused = ["source.skip_periods"] if axis.source.skip_periods else []
    unused += [name for name in _OTHER_RUNS if getattr(axis, name) is not None]
    for name in sorted(axis.model_fields_set - _USED_WHOLE):
        section = getattr(axis, name)
        if isinstance(section, BaseModel):
            used = _USED.get(name, set())
            kind = type(section)
            set_keys = [k for k in sorted(section.model_fields_set - used) if _differs(section, k)]
            unused += [f"{name}.{kind.model_fields[key].alias or key}" for key in set_keys]
    if axis.tracking.estimator not in _ESTIMATORS:
        unused.append(f"tracking.estimator {axis.tracking.estimator!r}")
    if len(axis.source.logs) > 1:
        unused.append("a list in source.log")
    if unused:
        raise ConfigError(
            "key-conflict",
            f"{unused[0]} belongs to a single response, but [signals] lists several channels: a matrix of responses",
            "remove it, or name one channel for each signal",
            key=unused[0],
        )


def _differs(section: BaseModel, key: str) -> bool:
    """Whether the key has another value than its default."""
    return bool(getattr(section, key) != type(section).model_fields[key].get_default(call_default_factory=True))


def _check_signals(axis: Axis) -> None:
    signals, estimator = axis.signals, axis.tracking.estimator
    needed = {"direct": ("input",), "joint": ("input", "excitation"), "indirect": ("excitation",)}[estimator]
    for role in needed:
        if not signals.listed(role):
            raise ConfigError(
                "key-missing",
                f"the {estimator} estimator needs signals.{role}",
                "name its channels",
                key=f"signals.{role}",
            )
    inputs, excitations = signals.listed("input"), signals.listed("excitation")
    if inputs and excitations and len(inputs) != len(excitations):
        raise ConfigError(
            "value-mismatch",
            f"signals.input lists {len(inputs)} and signals.excitation {len(excitations)}: {', '.join(excitations)}",
            "name one excitation for each input, in the same order",
            key="signals.excitation",
            value=excitations,
        )
    roles = [name for role in ("output", *needed) for name in signals.listed(role)]
    if twice := next((name for name in roles if roles.count(name) > 1), None):
        raise ConfigError(
            "key-conflict",
            f"channel {twice!r} is named for two signals",
            "give each signal its own channel",
            key="signals",
            value=twice,
        )
    if estimator == "indirect" and not axis.loop.controllers:
        raise ConfigError(
            "key-missing",
            "the indirect estimator needs the controllers of the loop",
            "describe them in [[loop.controllers]], or use the joint estimator",
            key="loop.controllers",
        )
    check_controllers(axis.loop, signals.listed("output"), inputs or excitations)


def check_controllers(loop: LoopSection, outputs: Sequence[str], inputs: Sequence[str]) -> None:
    """ConfigError if a controller joins signals that the matrix does not have."""
    for controller in loop.controllers:
        _check_controller(controller, outputs, inputs)


def _check_controller(controller: ControllerSection, outputs: Sequence[str], inputs: Sequence[str]) -> None:
    for role, name, names in (
        ("output", controller.output, outputs),
        ("input", controller.input, inputs),
    ):
        if name not in names:
            raise ConfigError(
                "value-mismatch",
                f"a controller in [[loop.controllers]] has the {role} {name!r}, which [signals] does not list",
                f"name one of {', '.join(names)}",
                key="loop.controllers",
                value=name,
            )


def matrix_lines(axis: Axis, rate_hz: float) -> Lines:
    """The lines of a matrix at the rate of its source."""
    frequencies, window = axis.lines.frequencies, axis.lines.window
    assert window != "auto"
    return Lines.parse(frequencies, rate_hz, window)


def matrix_settings(axis: Axis, rate_hz: float, hop: int | None = None) -> MatrixSettings:
    """Settings of a MatrixTracker for samples of this rate, with this default hop.

    Raises
    ------
    LivebodeError
        If the values do not fit each other or the rate.
    """
    from livebode.configuration.experiments_section import ExperimentsSection
    from livebode.mimo import MatrixSettings

    signals, of = axis.signals, axis.experiments or ExperimentsSection()
    return MatrixSettings(
        lines=matrix_lines(axis, rate_hz),
        output=signals.listed("output"),
        input=signals.listed("input"),
        excitation=signals.listed("excitation"),
        estimator=axis.tracking.estimator,  # type: ignore[arg-type] # check_matrix has refused the others
        loop=matrix_loop(
            axis.loop, signals.listed("input") or signals.listed("excitation"), signals.listed("output"), rate_hz
        ),
        experiments=of.number,
        dwell=of.dwell_periods,
        settle=of.settle_periods,
        start=of.start,
        hop=axis.tracking.hop or hop,
        memory=of.memory,
        average=axis.tracking.average,
        condition_max=of.condition_max,
    )


def matrix_loop(loop: LoopSection, inputs: list[str], outputs: list[str], rate_hz: float) -> MatrixLoop:
    """The loop of these [[loop.controllers]], recorded at `rate_hz`; ConfigError if a controller cannot be built."""
    from livebode.mimo import MatrixLoop

    feedback: list[list[Model | None]] = [[None] * len(outputs) for _ in inputs]
    for controller in loop.controllers:
        feedback[inputs.index(controller.input)][outputs.index(controller.output)] = controller.build(rate_hz)
    return MatrixLoop(
        feedback=feedback if loop.controllers else None,
        input_logged=loop.input_logged,
        excitation_logged=loop.excitation_logged,
        output_logged=loop.output_logged,
    )
