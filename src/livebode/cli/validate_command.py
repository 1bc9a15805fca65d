"""`livebode validate`: test the fitted model of a run on independent data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli.options import Excitation, Json, Output
from livebode.core import RecordError
from livebode.core.writing import writing
from livebode.records import RunRecord, to_json

if TYPE_CHECKING:
    from livebode.validation import Validation


def validate_command(
    directory: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory.")],
    on: Annotated[Path, typer.Option("--on", metavar="LOG", help="A recording that the run does not contain.")],
    model: Annotated[
        list[str] | None, typer.Option(help="rigid, two-mass, …; repeat to compare. \\[default: the run's \\[fit]]")
    ] = None,
    radius: Annotated[
        float | None, typer.Option(metavar="M", help="Radius of the pulley, for a load in linear motion.")
    ] = None,
    lags: Annotated[int, typer.Option(min=1, help="Largest lag of the correlations, in samples.")] = 40,
    samples: Annotated[int | None, typer.Option(min=1, help="Use only the last ones. \\[default: all]")] = None,
    output: Output = None,
    input: Annotated[str | None, typer.Option(metavar="CHANNEL", help="Channel of the plant input u.")] = None,
    excitation: Excitation = None,
    as_json: Json = False,
) -> None:
    """Simulate the fitted model with another recording and test whether the residual correlates with the signals.

    Writes validation.png to the run directory. The parameters are constant: the mean over the run, also for a
    machine whose plant changes with position. The channels default to those of the run.
    """
    from livebode.analysis.validation import validate_run
    from livebode.configuration.axis import FitSection
    from livebode.configuration.recorded import recorded_configuration
    from livebode.report import save_validation_picture

    base = recorded_configuration(RunRecord.open(directory).summary).get("fit", {}) | (
        {} if radius is None else {"radius_m": radius}
    )
    named = [{"model": name} for name in model or []] or [{}]
    sections = [FitSection.model_validate(base | one) for one in named]
    channels = {"output": output, "input": input, "excitation": excitation}
    found, notes = validate_run(directory, on, sections, lags=lags, samples=samples, channels=channels)
    with writing(directory, RecordError):
        picture = save_validation_picture(found, directory, title=f"{directory.name} on {on.name}")
    if as_json:
        print(to_json({"models": [v.plain() for v in found], "notes": notes}))
        return
    for validation in found:
        show_validation(validation)
    for sentence in notes:
        print(sentence)
    print(f"\n{picture}")


def show_validation(found: Validation) -> None:
    """Print the verdict and the tests behind it."""
    print(found.sentence)
    white = "white" if found.whiteness >= 0.03 else "not white"
    of_it = f"rms {found.residual_sigma:.3g}"
    print(f"  {found.samples} samples; the residual is {white} (p = {found.whiteness:.2g}), {of_it}")
    for c in found.correlations:
        counts = "counts" if c.name in found.judged_by else "does not count"
        lags = "all lags" if c.judged.all() else f"lags {c.lags[c.judged][0]} … {c.lags[-1]}"
        print(
            f"  with {c.name}, {lags}: {100 * c.share:.0f} % inside the limit, {100 * c.white_share:.0f} % inside "
            f"2.17/√L = {c.white_limit:.3g}; largest {c.largest:.3g}, together p = {c.p:.2g}; {counts}"
        )
