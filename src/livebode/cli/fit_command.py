"""`livebode fit`: fit a model to a finished run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from livebode.cli.next_step import NextCommand
from livebode.cli.options import Json, parsed_band
from livebode.cli.section_options import with_keys
from livebode.core import UsageError
from livebode.estimates import kind_of, rule
from livebode.locations import location

if TYPE_CHECKING:
    from livebode.configuration import FitSection
    from livebode.fitting import CommonPoles, Kind
    from livebode.records import RunRecord

_OPTIONS = {"radius_m": "radius", "inertia_ratio": "ratio", "fixed": "fix"}


@with_keys(
    fit={
        "side": ("--side", ""),
        "radius_m": ("--radius", "M"),
        "inertia_ratio": ("--ratio", ""),
        "free": ("--free", "NAME"),
        "hold": ("--hold", ""),
    }
)
def fit_command(
    directories: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Run directory; several, of one input and different outputs, for common poles.",
            parser=location,
        ),
    ],
    *,
    model: Annotated[
        str | None,
        typer.Option(
            help="rigid, two-mass, three-mass, two-mass-gain or auto (two-mass if the input is a torque in N m); for "
            "any machine modal (modes) or rational (poles)."
        ),
    ] = None,
    order: Annotated[
        int | None,
        typer.Option(help="Of modal: number of modes; of rational: of poles without integrators. \\[default: by BIC]"),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option(help="Quantity of y: velocity, position or auto (by its kind; without a unit, the better fit)."),
    ] = None,
    fix: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Fix a parameter at this value.")] = None,
    sections: dict[str, dict[str, Any]],
    band: Annotated[
        str | None, typer.Option(metavar="LOW:HIGH", help="Use only the lines from LOW to HIGH Hz.")
    ] = None,
    entry: Annotated[
        list[str] | None,
        typer.Option(
            metavar="OUTPUT/INPUT", help="Entry of a matrix run, such as velocity2/u1; of common poles several."
        ),
    ] = None,
    as_json: Json = False,
) -> NextCommand | None:
    """Fit a model to the response of a run, and print its parameters with bounds.

    With modal or rational the outputs of several runs have their poles in common, and so do all entries of a matrix run
    (rational by default). Of one run, modal writes stabilisation.svg to its directory. Defaults are from the run's
    \\[fit] section. Exit code 3 if no model fits.
    """
    from livebode.configuration import check_model
    from livebode.fitting import POLE_MODELS, Kind
    from livebode.records import RunRecord

    if model is not None:
        check_model(model)
    given: dict[str, Any] = {
        "model": model,
        "output": output,
        "fixed": dict(_pair(text) for text in fix) if fix else None,
        "band_hz": parsed_band(band) if band else None,
    }
    specified = {name: value for name, value in given.items() if value is not None} | sections.get("fit", {})
    if not entry and (model is None or model in POLE_MODELS) and (fit := _fit_rule(directories)) is not None:
        run = RunRecord.open(directories[0], matrix=True)
        _check_options(kind := cast(Kind, model or "rational"), specified)
        section = _section(run.path, {name: specified[name] for name in specified if name != "model"})
        found, remarks = fit(run, kind, section, order)
        _show_poles(found, remarks, as_json)
        return NextCommand("report", directories[0])
    runs = _opened(directories, entry or [])
    if model in POLE_MODELS:
        _fit_poles(runs, cast(Kind, model), specified, order, as_json)
    else:
        _fit_physical(runs, specified, order, as_json)
    return NextCommand("report", directories[0]) if len(directories) == 1 else None


def _fit_rule(directories: list[Path]) -> Any:
    """What fits a whole run of its kind; None where each response is fitted."""
    from livebode.records import read_summary

    return rule(kind_of(read_summary(directories[0])[0]), "fit") if len(directories) == 1 else None


def _opened(directories: list[Path], entries: list[str]) -> list[RunRecord]:
    """The runs, or the entries of one matrix run."""
    from livebode.records import RunRecord

    if not entries:
        return [RunRecord.open(directory) for directory in directories]
    if len(directories) > 1:
        raise UsageError(
            "conflict", "entries cannot be combined with several runs", "give one matrix run", argument="entry"
        )
    return [RunRecord.open(directories[0], entry=name) for name in entries]


def _fit_physical(runs: list[RunRecord], specified: dict[str, Any], order: int | None, as_json: bool) -> None:
    from livebode.analysis import averaged, fit_averaged, fit_remarks, plain_fit
    from livebode.cli.pictures import show_fit
    from livebode.configuration import recorded_configuration
    from livebode.records import to_json

    if len(runs) > 1 or order is not None:
        what = "several runs" if len(runs) > 1 else "--order"
        raise UsageError(
            "conflict",
            f"{what} cannot be combined with a physical model",
            "add --model modal or --model rational" + ", with one run for each output" * (len(runs) > 1),
            argument="RUN" if len(runs) > 1 else "order",
        )
    run = runs[0]
    configuration = recorded_configuration(run.summary)
    section = _section(run.path, configuration.get("fit", {}) | specified)
    average = averaged(run)
    found, words = fit_averaged(average, section)
    source, signals = (configuration.get(name, {}) for name in ("source", "signals"))
    live = "url" in source or bool(source.get("follow"))
    remarks = fit_remarks(average, section, found, str(signals.get("output", "y")), live=live)
    if as_json:
        print(to_json({"fitted_to": words} | plain_fit(found) | {"remarks": remarks}))
    else:
        show_fit(found, words)
        for remark in remarks:
            print(f"  {remark}")
    if found.status != "ok":
        raise typer.Exit(3)


def _fit_poles(
    runs: list[RunRecord], model: Kind, specified: dict[str, Any], order: int | None,
    as_json: bool,
) -> None:  # fmt: skip
    from livebode.analysis import fit_poles
    from livebode.configuration import recorded_configuration

    _check_options(model, specified)
    own = recorded_configuration(runs[0].summary).get("fit", {})
    kept = {name: own[name] for name in ("band_hz", "hold") if name in own}
    section = _section(runs[0].path, kept | {name: specified[name] for name in specified if name != "model"})
    found, remarks = fit_poles(runs, model, section, order)
    picture = _chart(found, runs[0].path) if model == "modal" and len(runs) == 1 else None
    _show_poles(found, remarks, as_json, picture)


def _check_options(model: Kind, specified: dict[str, Any]) -> None:
    if other := sorted(specified.keys() - {"model", "band_hz", "hold"}):
        raise UsageError(
            "conflict",
            f"the model {model!r} has no option {_OPTIONS.get(other[0], other[0])!r}",
            "leave it out",
            argument=other[0],
            model=model,
        )


def _chart(found: CommonPoles, run: Path) -> Path:
    """The picture of the stabilisation chart in the directory of the run."""
    from livebode.cli.remote import results_directory
    from livebode.core import RecordError, writing
    from livebode.pictures import save_stabilisation

    into = results_directory(run)
    with writing(into, RecordError):
        return save_stabilisation(found, into, title=run.name)


def _show_poles(found: CommonPoles, remarks: list[str], as_json: bool, picture: Path | None = None) -> None:
    from livebode.analysis import plain_poles
    from livebode.cli.pictures import show_poles
    from livebode.records import to_json

    if as_json:
        print(to_json(plain_poles(found, remarks)))
    else:
        show_poles(found)
        for remark in remarks:
            print(f"  {remark}")
        if picture is not None:
            print(f"\n{picture}")
    if found.status != "ok":
        raise typer.Exit(3)


def _section(directory: Path, values: dict[str, Any]) -> FitSection:
    from livebode.configuration import Axis

    data = {"source": {"log": str(directory)}, "signals": {"output": "y"}, "fit": values}
    section = Axis.of(data, "the options").fit
    assert section is not None
    return section


def _pair(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise UsageError(
            "unreadable",
            f"{text!r} is not NAME=VALUE with a number",
            "write for example Js=0.0028",
            argument="fix",
            value=text,
        ) from None
