"""A matrix of responses: which keys of an axis belong to it, and its settings."""

from __future__ import annotations

from livebode.configuration import Axis, ExperimentsSection, check_controllers, matrix_loop
from livebode.core import ConfigError, Lines, TypedTable
from livebode_matrix.settings import MatrixSettings

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
        if isinstance(section, TypedTable):
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


def _differs(section: TypedTable, key: str) -> bool:
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
