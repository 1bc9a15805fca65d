"""A proposed controller for the loop of a finished run."""

from __future__ import annotations

from pathlib import Path

from livebode.analysis import by_place, checked_loop, equivalent_plant
from livebode.configuration import LoopSection, check_controllers, matrix_loop, recorded_configuration, recorded_loop
from livebode.core import PID, Cascade, LivebodeError, Loop, PositionPD, Responses, SignalError, TuneError
from livebode.fitting import mean_matrix
from livebode.locations import Location
from livebode.motion import FrictionCurve, OutputKind, friction_curve
from livebode.records import RunRecord, entry_named
from livebode_control.strokes.motion_samples import read_strokes
from livebode_control.tuning import ControllerProposal, LoopSpecification, tune
from livebode_control.tuning.feedforward import Feedforward
from livebode_control.tuning.gain_schedule import GainSchedule, gain_schedule

_CONTRADICTED = ("one change", "not explained")


def tune_run(
    directory: Path,
    specification: LoopSpecification,
    section: LoopSection | None = None,
    *,
    loop_checked: bool = False,
    entry: str | None = None,
) -> ControllerProposal:
    """The proposal for a run; the loop is described by `section`, else by its configuration.

    The responses are the mean of the run, or with a schedule the means at twelve places. Of an entry of a matrix run
    they are the plant that its controller sees while the others are active as described (`equivalent_plant`).

    Parameters
    ----------
    directory
        Run directory.
    specification
        Limits.
    section
        Another description of the loop.
    loop_checked
        The description was verified otherwise, where no `livebode validate --loop` of the run confirms it.
    entry
        Of a matrix run: the controller, "output/input".

    Raises
    ------
    TuneError
        If nothing can be proposed.
    UsageError
        If the loop's feedback is missing.
    """
    if entry is not None:
        return _tune_entry(directory, specification, section, loop_checked, entry)
    responses, loop, checked = _inputs(directory, section, loop_checked)
    return tune(responses, loop, specification, loop_checked=checked)


def _tune_entry(
    directory: Path, specification: LoopSpecification, section: LoopSection | None, loop_checked: bool, entry: str
) -> ControllerProposal:
    run = RunRecord.open(directory, matrix=True)
    output, input = entry_named(str(directory), run.summary, entry)
    if section is None:
        section = recorded_loop(run.summary)
    responses = mean_matrix(run.matrix())
    rate_hz, (outputs, inputs) = responses.lines.rate_hz, (responses.outputs, responses.inputs)
    own = section.of_controller(output, input).build(rate_hz)
    if own.feedback is None:
        raise TuneError(
            "no-controller",
            f"no controller joins {output} and {input}, so there is none to tune",
            "describe all controllers under [[loop.controllers]], in the configuration of the run or in another file",
            entry=entry,
        )
    check_controllers(section, outputs, inputs)
    plant = equivalent_plant(responses, matrix_loop(section, list(inputs), list(outputs), rate_hz), output, input)
    proposal = tune(plant, own, specification, loop_checked=_confirmed(directory, section) or loop_checked)
    if proposal.before is None:
        # Then the other loops alone may be unstable, and what the lines show does not tell a stable proposal.
        raise TuneError(
            "loop-contradicted",
            f"with the measured matrix the controller {entry} does not come out as stable, as it is on the machine",
            "add lines at low frequencies and around the crossover, or correct [[loop.controllers]]",
            key="loop.controllers",
        )
    return proposal


def schedule_run(
    directory: Path, specification: LoopSpecification, section: LoopSection | None = None, *, loop_checked: bool = False
) -> GainSchedule:
    """Gains that follow the schedule of a run, for the specification; errors as of `gain_schedule`."""
    responses, loop, checked = _inputs(directory, section, loop_checked)
    return gain_schedule(responses, loop, specification, loop_checked=checked)


def _inputs(directory: Path, section: LoopSection | None, loop_checked: bool) -> tuple[Responses, Loop, bool]:
    """Mean responses by place, the loop, and whether its description was checked."""
    run = RunRecord.open(directory)
    if section is None:
        section = recorded_loop(run.summary)
    responses = Responses.join(list(run.steady_batches()))
    loop = section.described(responses.lines.rate_hz)
    checked = _confirmed(directory, section) or loop_checked
    if not checked and not recorded_configuration(run.summary).get("signals", {}).get("excitation"):
        raise TuneError(
            "loop-unchecked",
            "the run does not name the excitation w (signals.excitation), with which the described controllers are "
            "compared with the recording",
            "run again with signals.excitation and use livebode validate --loop, or state that they were compared",
            argument="loop_checked",
        )
    return by_place(responses), loop, checked


def feedforward_of(
    directory: Path, controller: PID | Cascade | PositionPD, strokes: Location | None = None
) -> Feedforward | None:
    """Feedforward for a run: inertia from its responses, friction from `strokes` or else the run's own recording.

    None where the lines do not show the inertia, or it is not known whether the output is a position or a velocity.
    Without friction where the run's own recording has no strokes in both directions.
    """
    run = RunRecord.open(directory)
    kind = _kind(run.kinds.output, controller)
    if kind is None:
        return None
    try:
        friction = _friction(directory if strokes is None else strokes, kind)
    except LivebodeError:
        if strokes is not None:
            raise
        friction = None
    try:
        return Feedforward.of(by_place(Responses.join(list(run.steady_batches()))), kind, friction)
    except SignalError:
        return None


def _kind(recorded: str | None, controller: PID | Cascade | PositionPD) -> OutputKind | None:
    """Quantity of the output: as recorded; without a unit, by the controller."""
    if recorded == "velocity" or (recorded is None and isinstance(controller, Cascade)):
        return "velocity"
    if recorded == "position" or (recorded is None and isinstance(controller, PositionPD)):
        return "position"
    return None


def _friction(target: Location, kind: OutputKind) -> FrictionCurve:
    strokes = read_strokes(target)
    return friction_curve(strokes.block, input=strokes.input, output=strokes.output, kind=kind)


def _confirmed(directory: Path, section: LoopSection) -> bool:
    """Whether the recording confirms this description of the loop; TuneError if it contradicts it."""
    check = checked_loop(directory, section)
    if check.verdict in _CONTRADICTED:
        raise TuneError("loop-contradicted", check.sentence, "correct [loop], and check it again", key="loop")
    return check.verdict == "as described"
