"""`livebode validate`: a run's fitted model judged on fresh data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from livebode.cli.options import Excitation, Json, Output
from livebode.records import Run, to_json

if TYPE_CHECKING:
    from livebode.validation import Validation


def validate_command(
    directory: Annotated[Path, typer.Argument(metavar="RUN", help="Directory that a run left.")],
    on: Annotated[Path, typer.Option("--on", metavar="LOG", help="A recording that the run was not made of.")],
    model: Annotated[
        list[str] | None, typer.Option(help="rigid, two-mass, …, each judged; that of the run's \\[fit] unless said.")
    ] = None,
    radius: Annotated[float | None, typer.Option(metavar="M", help="Pulley's radius, for a load that moves.")] = None,
    lags: Annotated[int, typer.Option(min=1, help="Of the correlations, in samples to both sides.")] = 40,
    samples: Annotated[int | None, typer.Option(min=1, help="Take the last ones only; all unless said.")] = None,
    output: Output = None,
    input: Annotated[str | None, typer.Option(metavar="CHANNEL", help="Channel of the plant input u.")] = None,
    excitation: Excitation = None,
    as_json: Json = False,
) -> None:
    """Drive the fitted model by another recording and say whether what is left still follows the signals.

    Leaves validation.png in the run's directory. The model's parameters are constants: the mean over the run. A
    machine that moves along a changing plant is judged by that mean. Channels are the run's, unless named here.
    """
    from livebode.report import save_validation_picture
    from livebode.session.axis import FitSection
    from livebode.session.said import said
    from livebode.session.validation import validate_run

    base = said(Run.open(directory).summary).get("fit", {}) | ({} if radius is None else {"radius_m": radius})
    named = [{"model": name} for name in model or []] or [{}]
    sections = [FitSection.model_validate(base | one) for one in named]
    channels = {"output": output, "input": input, "excitation": excitation}
    found, notes = validate_run(directory, on, sections, lags=lags, samples=samples, channels=channels)
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
    """The verdict and what it rests on."""
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
