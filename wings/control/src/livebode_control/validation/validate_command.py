"""`livebode validate`: test the fitted model of a run on independent data, or the description of its loop."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli import Entry, Excitation, Json, NextCommand, Output, check_use, results_directory
from livebode.core import LivebodeError, RecordError, UsageError, writing
from livebode.locations import location

if TYPE_CHECKING:
    from livebode.configuration import Axis, FitSection
    from livebode_control.validation.line_validation import LineValidation
    from livebode_control.validation.validation import Validation

Channels = dict[str, str | None]


def validate_command(
    context: typer.Context,
    directory: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory.", parser=location)],
    on: Annotated[
        Path | None,
        typer.Option(
            "--on",
            metavar="LOG|RUN",
            help="A recording that the run does not contain, or another run.",
            parser=location,
        ),
    ] = None,
    loop: Annotated[
        bool, typer.Option("--loop", help="Compare the described controllers with the signals of the run instead.")
    ] = False,
    axis: Annotated[
        Path | None,
        typer.Option(metavar="AXIS.toml", help="For --loop: read \\[loop] from this file instead of the run."),
    ] = None,
    model: Annotated[
        list[str] | None,
        typer.Option(
            help="rigid, two-mass, … modal, rational or auto; repeat to compare. \\[default: the run's \\[fit]]"
        ),
    ] = None,
    samples: Annotated[int | None, typer.Option(min=1, help="Use only the last ones. \\[default: all]")] = None,
    output: Output = None,
    input: Annotated[str | None, typer.Option(metavar="CHANNEL", help="Channel of the plant input u.")] = None,
    excitation: Excitation = None,
    at_lines: Annotated[
        bool,
        typer.Option("--at-lines", help="Track LOG and compare at the lines. \\[default: if no simulation can judge]"),
    ] = False,
    entry: Entry = None,
    as_json: Json = False,
) -> NextCommand:
    """Test the fitted model on another recording, or with --loop the described controllers on the recorded signals.

    With --on, the model is simulated with the other recording, and the residual is tested for correlation with the
    signals; writes validation.svg to the run directory. The parameters are constant: the mean over the run, also for a
    machine whose plant changes with position. The channels default to those of the run. A model whose simulation is
    not valid, such as of a double integrator that drifts, is judged at the lines: LOG is tracked as the run was. So is
    an entry of a matrix run.

    With --loop, the result is as described, or the change of the description that explains the signals. It needs
    excitation, input and output in the samples of the run, and writes loop-check.json to the run directory: `livebode
    margins` and `livebode report` show it. Of a matrix run each of [[loop.controllers]] is compared with its own
    signals.
    """
    check_use(context, "--loop", ("--axis",), ("--output", "--input", "--excitation"))
    channels = {"output": output, "input": input, "excitation": excitation}
    if loop:
        from livebode_control.loop_check.loop_check_command import validate_loop

        validate_loop(directory, axis, channels, as_json=as_json)
        return NextCommand("report", directory)
    if on is None:
        raise _nothing_to_validate()
    _validate_model(directory, on, model or [], samples, channels, at_lines, entry, as_json=as_json)
    return NextCommand("report", directory, entry=entry)


def _nothing_to_validate() -> UsageError:
    return UsageError(
        "missing",
        "there is nothing to validate",
        "give --on LOG to test the fitted model, or --loop to compare the described controllers with the signals",
        options=["--on", "--loop"],
    )


def _validate_model(
    directory: Path, on: Path, models: list[str], samples: int | None,
    channels: Channels, at_lines: bool, entry: str | None, *, as_json: bool,
) -> None:  # fmt: skip
    """Test the models on a recording or another run, write their picture, and print the verdicts."""
    from livebode.configuration import FitSection, check_model, recorded_configuration
    from livebode.records import RunRecord, to_json
    from livebode_control.validation.run_validation import validate_run

    for name in models:
        check_model(name)
    base = recorded_configuration(RunRecord.open(directory, entry=entry).summary).get("fit", {})
    named = [{"model": name} for name in models] or [{}]
    sections = [FitSection.model_validate(base | section) for section in named]
    reasons = [_reason(section, on, at_lines, entry) for section in sections]
    simulated = [section for section, reason in zip(sections, reasons) if not reason]
    simulated_results: list[Validation] = []
    notes: list[str] = []
    if simulated:
        simulated_results, notes = validate_run(directory, on, simulated, samples=samples, channels=channels)
    drifting = {v.model: v.why_lines for v in simulated_results if v.drifts}
    wanted = [(section, reason) for section, reason in zip(sections, reasons) if reason or drifting]
    line_results: list[LineValidation] = []
    if wanted:
        line_results, more = _at_lines(directory, on, wanted, drifting, channels, entry)
        notes = list(dict.fromkeys([*notes, *more]))
    simulated_results = [
        v for v in simulated_results if v.model not in {result.model for result in line_results}
    ]  # one verdict for each model
    picture = _picture(simulated_results, directory, on) if simulated_results else None
    if as_json:
        print(
            to_json(
                {
                    "models": [v.plain() for v in simulated_results] + [result.plain() for result in line_results],
                    "notes": notes,
                }
            )
        )
        return
    for validation in simulated_results:
        show_validation(validation)
    for result in line_results:
        show_line_validation(result)
    for sentence in notes:
        print(sentence)
    if picture is not None:
        print(f"\n{picture}")


def _reason(section: FitSection, on: Path, at_lines: bool, entry: str | None) -> str:
    """Why a model is judged at the lines from the beginning; empty for one that is simulated."""
    from livebode.fitting import POLE_MODELS
    from livebode.records import is_run

    if entry is not None:
        return "the other inputs of a matrix move the output too"
    if at_lines:
        return "--at-lines asks for it"
    if is_run(on):
        return f"{on.name} is a run, not a recording"
    return f"a {section.model} model is not simulated" if section.model in POLE_MODELS else ""


def _picture(results: list[Validation], directory: Path, on: Path) -> Path:
    from livebode_control.validation.validation_picture import save_validation_picture

    into = results_directory(directory)
    with writing(into, RecordError):
        return save_validation_picture(results, into, title=f"{directory.name} on {on.name}")


def _at_lines(
    directory: Path,
    on: Path,
    sections: list[tuple[FitSection, str]],
    drifting: dict[str, str],
    channels: Channels,
    entry: str | None,
) -> tuple[list[LineValidation], list[str]]:
    """On another run; a recording is tracked as the run was, in a directory that is removed."""
    from tempfile import TemporaryDirectory

    from livebode.records import is_run
    from livebode.runtime import Destination, run
    from livebode_control.validation.line_validation import validate_run_at_lines

    if is_run(on):
        return validate_run_at_lines(directory, on, sections, drifting, entry)
    with TemporaryDirectory() as there:
        other = Path(there) / on.stem
        try:
            run(_tracked_alike(directory, on, channels), Destination(other, lambda *_: None))
        except LivebodeError as error:
            if all(reason for _, reason in sections):
                raise
            return [], [f"{on.name} cannot be tracked, so the model cannot be judged at the lines: {error}"]
        return validate_run_at_lines(directory, other, sections, drifting, entry)


def _tracked_alike(directory: Path, on: Path, channels: Channels) -> Axis:
    """The configuration of the run for another recording."""
    from livebode.configuration import Axis, recorded_configuration
    from livebode.records import RunRecord

    own = recorded_configuration(RunRecord.open(directory, matrix=True).summary)
    data = {name: own[name] for name in ("signals", "lines", "tracking", "experiments", "loop") if name in own}
    of_source = own.get("source", {})
    source = {name: of_source[name] for name in ("rate_hz", "time", "dbc", "kinds", "units") if name in of_source}
    signals = data.get("signals", {}) | {role: name for role, name in channels.items() if name}
    return Axis.of(data | {"source": source | {"log": on}, "signals": signals}, str(directory))


def show_validation(validation: Validation) -> None:
    """Print the verdict and the tests behind it."""
    print(validation.sentence)
    white = "white" if validation.whiteness >= 0.03 else "not white"
    of_it = f"rms {validation.residual_sigma:.3g}"
    print(f"  {validation.samples} samples; the residual is {white} (p = {validation.whiteness:.2g}), {of_it}")
    for c in validation.correlations:
        counts = "counts" if c.name in validation.judged_by else "does not count"
        lags = "all lags" if c.judged.all() else f"lags {c.lags[c.judged][0]} … {c.lags[-1]}"
        print(
            f"  with {c.name}, {lags}: {100 * c.share:.0f} % inside the limit, {100 * c.white_share:.0f} % inside "
            f"2.17/√L = {c.white_limit:.3g}; largest {c.largest:.3g}, together p = {c.p:.2g}; {counts}"
        )


def show_line_validation(validation: LineValidation) -> None:
    """Print the verdict and the numbers behind it."""
    print(validation.sentence)
    at_hz, sigmas = validation.worst
    print(
        f"  chi² {validation.chi2:.3g} per degree of freedom by both uncertainties (p = {validation.p:.2g}); "
        f"worst line {at_hz:g} Hz, {sigmas:.2g} sigma"
    )
