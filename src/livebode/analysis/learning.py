"""From finished runs of a healthy machine to its Baseline."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from datetime import UTC, datetime
from math import pi
from os import PathLike
from typing import Any, Protocol

from livebode.configuration import Axis, FitSection, OrdersSection, fitter_of, open_recording, recorded_configuration
from livebode.core import BaselineError, Block, Lines, LivebodeError, PlantKinds, Responses
from livebode.locations import Location, Url, local_copy, resolved
from livebode.monitoring import (
    Baseline,
    LearnedMachine,
    LearnedTorque,
    NonOverlappingWindows,
    ScheduleTable,
    WindowRows,
    learn_machine,
    learn_table,
    learn_torque,
    places,
)
from livebode.motion import Shaft
from livebode.records import RunRecord, in_stored_precision, matrix_unsupported

_ROLES = ("output", "input", "excitation", "schedule")
# The belt's parameters referred to the motor shaft; changes are reported in percent.
_RADIUS_M = 1.0


def learn(
    paths: str | PathLike[str] | Url | Sequence[str | PathLike[str] | Url],
    report: Callable[[str], None] = lambda _: None,
) -> Baseline:
    """The Baseline of runs of the healthy machine, all with the same lines and signals; as `livebode learn`.

    Tables are learned from the runs' responses. With a torque and a scheduling position, a model of the moving machine
    is also learned, from the recordings of the runs; `report` receives the progress. Runs may be at URLs.

    Raises
    ------
    RecordError
        If a run cannot be read.
    BaselineError
        If the runs do not match, or contain too little data.
    LocationError
        If a run at a URL cannot be downloaded.

    Examples
    --------
    >>> import livebode, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     baseline = learn([livebode.example_run(f"{folder}/healthy", seconds=5)])
    >>> baseline.tables[0].names[:3], baseline.hop
    (('20 Hz', '30 Hz', '40 Hz'), 100)
    """
    if isinstance(paths, str | PathLike | Url):
        paths = [paths]
    if not paths:
        raise BaselineError("no-runs", "there is no run to learn from", "name at least one run directory")
    with ExitStack() as copies:
        runs = [RunRecord.open(copies.enter_context(local_copy(path)), matrix=True) for path in paths]
        check_no_matrix(runs)
        axes = [learnable_axis(recorded_configuration(run.summary), run.place) for run in runs]
        _check_once(runs, axes)
        return learn_from(runs, axes, report)


class HealthyRun(Protocol):
    """A run of a run directory or of a lake."""

    @property
    def is_matrix(self) -> bool:
        """Whether the run has matrices of responses."""

    @property
    def place(self) -> str:
        """Where it is, for its user."""

    @property
    def summary(self) -> dict[str, Any]:
        """Entries of run.json."""

    @property
    def found(self) -> dict[str, Any]:
        """Rate, window, hop, lines, quantity and unit."""

    @property
    def lines(self) -> Lines:
        """Lines of the measurement."""

    @property
    def kinds(self) -> PlantKinds:
        """Kinds of the plant's output and input."""

    def steady_batches(self) -> Iterator[Responses]:
        """Responses of a machine that was ready."""


def check_no_matrix(runs: Sequence[HealthyRun]) -> None:
    """RecordError if a run has matrices: the run itself is the baseline of others, and nothing is learned."""
    for run in runs:
        if run.is_matrix:
            raise matrix_unsupported(
                run.place,
                "a learned baseline",
                "set monitoring.baseline (--baseline) of the runs to compare to the directory of a matrix run of the "
                "healthy machine: it needs no learning",
            )


def learn_from(
    runs: Sequence[HealthyRun], axes: Sequence[Axis], report: Callable[[str], None] = lambda _: None
) -> Baseline:
    """The Baseline of runs, each with its `learnable_axis`, whose source.log is its recording.

    Responses are rounded to float32, as a lake stores them: run directories and a lake give the same baseline.

    Raises
    ------
    BaselineError
        If the runs do not match, or contain too little data.
    LivebodeError
        If responses or recordings cannot be read.
    """
    for run, axis in zip(runs, axes):
        _check_same(runs[0], axes[0], run, axis)
    report("learning the lines over the schedule")
    lines, signals = runs[0].lines, axes[0].signals
    names = [f"{f:g} Hz" for f in lines.frequency_hz]
    overlap = len(_apart(runs[0]))
    tables = [learn_table("lines", names, [rows for run in runs for rows in _rows(run)], overlap)]
    if axes[0].fit is not None:
        report("learning the fitted parameters over the schedule")
        tables.append(_parameters(runs, axes[0].fit))
    machine, remark = _machine(runs, axes, report)
    torque, torque_remark = _torque(runs, axes, report)
    if machine is None and (covariates := axes[0].monitoring.covariates):
        raise BaselineError(
            "covariates-without-machine",
            f"covariates ({', '.join(covariates)}) need a model of the moving machine, which these runs do not give: "
            f"{remark}",
            "remove them from [monitoring] to learn only tables",
            channels=list(covariates),
        )
    return Baseline(
        lines,
        runs[0].found["hop"],
        {role: getattr(signals, role) for role in _ROLES},
        axes[0].tracking.estimator,
        axes[0].tracking.quantity,
        tuple(tables),
        machine,
        torque,
        axes[0].motion is not None,
        runs=tuple(run.place for run in runs),
        remark=remark,
        torque_remark=torque_remark,
        learned=datetime.now(UTC).isoformat(timespec="seconds"),
    )


def learnable_axis(configuration: dict[str, Any], place: str) -> Axis:
    """The axis of a run's configuration; BaselineError if a baseline cannot be learned from such a run."""
    if "source" not in configuration:
        raise BaselineError(
            "run-not-of-machine",
            f"{place!r} is not the run of a machine",
            "learn from a directory that `livebode run` wrote",
            path=place,
        )
    if "output_only" in configuration:
        raise BaselineError(
            "run-without-responses",
            f"{place!r} has modes of the output alone, and no response to learn from",
            "learn from a run with an excitation",
            path=place,
        )
    axis = Axis.of(configuration, place)
    if not axis.tracking.periodic:
        raise BaselineError(
            "run-not-periodic",
            f"{place!r} was estimated with {axis.tracking.estimator!r}, and a baseline needs an excitation "
            "that repeats",
            "learn from a run with the estimator joint, direct or indirect",
            path=place,
        )
    if axis.tracking.average:
        raise BaselineError(
            "run-averaged",
            f"{place!r} was created with tracking.average, so that each response contains those before it",
            "learn from a run with tracking.average = false, or compare two averaged runs (livebode compare)",
            path=place,
        )
    return axis


def reads_recordings(axis: Axis) -> bool:
    """Whether a baseline of such runs has a model of the moving machine, which is learned from their recordings."""
    return None not in (axis.signals.input, axis.signals.schedule) and axis.tracking.quantity == "plant"


def _check_once(runs: list[RunRecord], axes: list[Axis]) -> None:
    """Duplicated data would count as twice as much evidence."""
    seen: dict[Location, RunRecord] = {}
    for run, axis in zip(runs, axes):
        replayed = () if axis.source.replay is None else (axis.source.replay,)
        things = [resolved(place) for place in (run.path, *axis.source.logs, *replayed)]
        for thing in things:
            if thing in seen:
                raise BaselineError(
                    "run-repeated",
                    f"{str(run.path)!r} contains the same data as {str(seen[thing].path)!r}",
                    "give each recording once",
                    path=str(run.path),
                    other=str(seen[thing].path),
                )
        seen |= dict.fromkeys(things, run)


def _check_same(first: HealthyRun, mine: Axis, run: HealthyRun, axis: Axis) -> None:
    for name, expected, other in (
        ("lines", True, first.lines.alike(run.lines) and first.lines.quiet == run.lines.quiet),
        ("hop", first.found["hop"], run.found["hop"]),
        ("signals", mine.signals, axis.signals),
        ("tracking options", mine.tracking, axis.tracking),
        ("motion options", mine.motion, axis.motion),
        ("fit options", mine.fit, axis.fit),
        ("covariates", mine.monitoring.covariates, axis.monitoring.covariates),
        ("the unit of the response", first.found.get("unit", ""), run.found.get("unit", "")),
    ):
        if expected != other:
            raise BaselineError(
                "runs-differ",
                f"{run.place!r} and {first.place!r} differ in {name}",
                "learn from runs with the same configuration",
                path=run.place,
                other=first.place,
                what=name,
            )


def _apart(run: HealthyRun) -> list[NonOverlappingWindows]:
    window, hop = run.lines.window, run.found["hop"]
    return [NonOverlappingWindows(max(window, hop), place) for place in places(window, hop)]


def _rows(run: HealthyRun) -> list[WindowRows]:
    """Rows at each place of the period."""
    each = _apart(run)
    return _joined([[apart.of_responses(batch) for apart in each] for batch in _rounded(run)])


def _rounded(run: HealthyRun) -> Iterator[Responses]:
    """The responses as a lake stores them."""
    return map(in_stored_precision, run.steady_batches())


def _joined(batches: list[list[WindowRows]]) -> list[WindowRows]:
    return [WindowRows.join(parts) for parts in zip(*batches)]


def _parameters(runs: Sequence[HealthyRun], section: FitSection) -> ScheduleTable:
    """The table of the fits; they are repeated, because a run's parameters.parquet has no covariance."""
    model = fitter_of(section, runs[0].kinds)
    names = [name for name in model.model.names if name not in model.held]
    rows = []
    for run in runs:
        fitter, each = fitter_of(section, run.kinds), _apart(run)
        fitted = (fitter.process(batch).only(names) for batch in _rounded(run))
        rows += _joined([[apart.of_parameters(part) for apart in each] for part in fitted])
    return learn_table("parameters", names, rows, len(_apart(runs[0])))


def _machine(
    runs: Sequence[HealthyRun], axes: Sequence[Axis], report: Callable[[str], None]
) -> tuple[LearnedMachine | None, str]:
    """A model of the moving machine, or the reason why there is none."""
    signals = axes[0].signals
    covariates = axes[0].monitoring.covariates
    if signals.input is None or signals.schedule is None:
        return None, "a model of the machine needs the torque and a scheduling position"
    if axes[0].tracking.quantity != "plant":
        return None, f"a model describes the plant, but the runs contain the {axes[0].tracking.quantity}"
    if any(len(axis.source.logs) != 1 for axis in axes):
        return None, "a model is learned from recordings, but not all of these runs are from one"
    report("learning a model of the moving machine from the recordings")
    names = [signals.input, signals.output, signals.schedule, *covariates]
    try:
        return (
            learn_machine(
                [_samples(run, axis, names) for run, axis in zip(runs, axes)],
                runs[0].lines,
                input=signals.input,
                output=signals.output,
                schedule=signals.schedule,
                radius_m=_RADIUS_M,
                covariates=covariates,
            ),
            "",
        )
    except LivebodeError as error:
        return None, str(error)


def _torque(
    runs: Sequence[HealthyRun], axes: Sequence[Axis], report: Callable[[str], None]
) -> tuple[LearnedTorque | None, str]:
    """Friction and orders, or the reason why there are none."""
    signals, kinds = axes[0].signals, runs[0].kinds
    if signals.input is None or not reads_recordings(axes[0]):
        return None, "friction and orders need the torque and a scheduling position"
    if kinds.output not in ("position", "velocity"):
        return None, "friction and orders need the unit or the kind of the output"
    if any(len(axis.source.logs) != 1 for axis in axes):
        return None, "friction and orders are learned from recordings, but not all of these runs are from one"
    report("learning friction and orders from the recordings")
    try:
        return (
            learn_torque(
                [_samples(run, axis, (signals.input, signals.output)) for run, axis in zip(runs, axes)],
                input=signals.input,
                output=signals.output,
                kind=kinds.output,
                lines_hz=runs[0].lines.frequency_hz,
                turn=axes[0].orders.turn or 2 * pi,
                shafts=_shafts(axes[0], kinds),
            ),
            "",
        )
    except LivebodeError as error:
        return None, str(error)


def _shafts(axis: Axis, kinds: PlantKinds) -> list[Shaft]:
    """Shafts of [orders]; without that section, the motor if its angle is in radians, turns or degrees."""
    section = axis.orders
    return section.all_shafts() if section != OrdersSection() or kinds.input == "torque" else []


def _samples(run: HealthyRun, axis: Axis, names: Sequence[str]) -> Callable[[], Iterator[Block]]:
    ready = axis.ready

    def blocks() -> Iterator[Block]:
        log = open_recording(axis)
        part = run.found.get("part")
        log = log if part is None else log.part(part["first"], part["stop"])
        if ready is None:
            return log.blocks(names)
        each = log.blocks(list(dict.fromkeys([*names, ready.channel])))
        return (part for block in each for part in ready.parts(block))

    return blocks
