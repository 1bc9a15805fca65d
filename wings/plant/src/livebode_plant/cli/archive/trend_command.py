"""`livebode archive trend`: how quantities change over months, for each machine of a lake."""

from __future__ import annotations

from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.cli import Json, NextCommand, ReportLanguage
from livebode.core import UsageError
from livebode_plant.cli.archive.selection import By, LakeOf, Limit, SelectionOptions, print_table, with_selection

if TYPE_CHECKING:
    from livebode_plant.lake import Lake
    from livebode_plant.report.hall_report import Hall
    from livebode_plant.trending import Assessment, Ranked, Selection


@with_selection("by", "below", "since", "until", "covariate", "recipe")
def trend_command(
    archive: LakeOf,
    chosen: SelectionOptions,
    quantity: Annotated[
        str | None,
        typer.Argument(metavar="QUANTITY", help="Name as in `livebode fit`, or MODEL:NAME if several have it."),
    ] = None,
    limit: Limit = 10.0,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Also write the worst machine's picture (.svg) or the table of all machines (.csv); without QUANTITY "
            "write FILE.html and FILE.pdf. \\[default: hall-report]",
        ),
    ] = None,
    name: Annotated[
        str, typer.Option(metavar="TEXT", help="Title of the page, without QUANTITY. \\[default: name of the lake]")
    ] = "",
    language: ReportLanguage = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Find how a quantity changes over months, for each machine; without QUANTITY, write all of them as one page.

    The influence of covariates, such as a temperature, is removed. Bounds cover 95 % and allow for outliers and for
    scatter that is correlated from run to run. The worst machine comes first. An asterisk marks a significant change:
    of the machines marked, at most 5 % are expected to be unchanged.

    The page of all quantities contains alarms of recordings that were compared with a baseline, significant changes in
    words, pictures of the worst machines, machines without data, and what was not assessed and why. The PDF needs the
    extra `pdf`.
    """
    from livebode.records import to_json
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.lake import Lake
    from livebode_plant.trending import assess, history

    picture = out is not None and out.suffix.lower() in (".svg", ".csv")
    of_one = {"--by": chosen.by is not None, f"--out={str(out)!r}": picture}
    _check(quantity, of_one, {"--name": name, "--language": language})
    lake = Lake(lake_url(archive))
    if quantity is None:
        pages = out or Path("hall-report")
        hall = write_hall_pages(
            lake, chosen.selection(), name, limit, language or "en", pages, force=force, as_json=as_json
        )
        names = [f"{of.history.model}:{of.history.name}" for of in hall.assessments if of.ranked]
        return NextCommand("archive", "trend", archive, names[0]) if names else None
    if out is not None and not picture:
        raise UsageError(
            "unreadable", f"--out={str(out)!r} is neither a .svg nor a .csv", "choose one of them", argument="--out"
        )
    runs = history(lake, quantity, chosen.selection(By.machine))
    (of,) = assess([runs], limit)
    if out is not None:
        _write(of, out, force=force)
    if as_json:
        print(to_json(plain(of)))
        return None
    _print(of, limit)
    if out is not None:
        print(out)
    return NextCommand("archive", "list", archive)


def _check(quantity: str | None, of_one: dict[str, Any], of_all: dict[str, Any]) -> None:
    """UsageError for an option of the other kind of result."""
    given = [option for option, value in (of_one if quantity is None else of_all).items() if value]
    if given:
        result = "one quantity" if quantity is None else "the page of all quantities"
        remedy = "name a QUANTITY" if quantity is None else "leave out the QUANTITY"
        raise UsageError(
            "conflict", f"{given[0]} is for {result}", f"{remedy}, or omit it", options=[given[0].partition("=")[0]]
        )


def plain(of: Assessment) -> dict[str, Any]:
    """Plain data for JSON."""
    history = of.history
    return {
        "quantity": history.name,
        "model": history.model,
        "unit": history.unit,
        "recipe": history.recipe,
        "runs": history.runs,
        "without_date": history.undated,
        "other_recipes": history.other_recipes,
        "machines": [_row(of, ranked) for ranked in of.ranked],
        "not_assessed": [{"machine": machine, "reason": reason} for machine, reason in of.not_assessed.items()],
        "silent": [{"machine": machine, "last": _day(time_s)} for machine, time_s in of.silent.items()],
    }


def _row(of: Assessment, one: Ranked) -> dict[str, Any]:
    trend = one.trend
    return {
        "machine": one.machine,
        "significant": one.significant,
        "p": trend.p,
        "months_to_limit": one.months if isfinite(one.months) else None,
        "runs": trend.runs,
        "outliers": trend.outliers,
        "left_out": trend.left_out,
        "from": _day(trend.since_s),
        "to": _day(trend.until_s),
        "unit": of.history.unit_of(one.machine),
        "level": trend.level,
        "per_month": trend.per_month,
        "per_month_bound_95": trend.per_month_bound_95,
        "since": _day(trend.slope_since_s),
        "change": trend.change,
        "change_bound_95": trend.change_bound_95,
        "percent_of_unit": trend.relative if isfinite(trend.relative) else None,
        "changes": [
            {"kind": c.kind, "date": _day(c.time_s), "amount": c.amount, "bound_95": c.bound_95} for c in trend.changes
        ],
        "covariates": [{"name": e.name, "per_unit": e.per_unit, "bound_95": e.bound_95} for e in trend.effects],
        "scatter": trend.scatter,
        "correlation": trend.correlation,
        "remarks": list(trend.remarks),
    }


def _print(of: Assessment, limit: float) -> None:
    from livebode.core import counted
    from livebode.language import quantity_name
    from livebode_plant.report.trend_words import amount, change_words, months, scale

    history = of.history
    machines, runs = counted(len(history.machines), "machine"), counted(history.runs, "run")
    print(f"{quantity_name(history.name)} ({history.model} model): {machines}, {runs}")
    rows = []
    for ranked in of.ranked:
        trend, unit = ranked.trend, history.unit_of(ranked.machine)
        rows.append((
            ranked.machine + " *" * ranked.significant, str(trend.runs),
            amount(trend, trend.per_month, trend.per_month_bound_95, unit), _day(trend.slope_since_s),
            amount(trend, trend.change, trend.change_bound_95, unit), scale(trend, unit)[1],
            ", ".join(change_words(trend, change, unit) for change in trend.changes), months(ranked, limit),
        ))  # fmt: skip
    if rows:
        print_table(("machine", "runs", "a month", "since", "in all", "unit", "changes", "limit"), rows, ("runs",))
    for line in remarks(of):
        print(line)


def remarks(of: Assessment) -> list[str]:
    """What limits the result, as sentences."""
    history = of.history
    lines = ["*: significant; at most 5 % of the machines marked are expected to be unchanged"] * any(
        ranked.significant for ranked in of.ranked
    )
    lines += [f"{ranked.machine}: {remark}" for ranked in of.ranked for remark in ranked.trend.remarks]
    lines += [f"{ranked.machine}: {ranked.trend.left_out} runs without a value or a covariate are left out"
              for ranked in of.ranked if ranked.trend.left_out]  # fmt: skip
    several = {ranked.machine: len(history.machines[ranked.machine].axes) for ranked in of.ranked}
    lines += [f"{machine}: {axes} axes together; --by axis shows each" for machine, axes in several.items() if axes > 1]
    lines += [f"{machine}: not assessed: {reason}" for machine, reason in of.not_assessed.items()]
    lines += [f"{machine}: no run since {_day(time_s)}" for machine, time_s in of.silent.items()]
    if history.undated:
        lines.append(f"{history.undated} runs without a date are left out")
    if history.other_recipes:
        lines.append(
            f"{history.other_recipes} runs with other settings than most of their axis are left out (--recipe)"
        )
    return lines


def _write(of: Assessment, out: Path, *, force: bool) -> None:
    from livebode.export import save

    if out.suffix.lower() == ".csv":
        save(out, lambda partial: _write_csv(of, partial), force=force)
        return
    from livebode.pictures import save_svg
    from livebode_plant.report.trend_words import year_figure, year_of

    if not of.ranked:
        raise UsageError(
            "missing", "no machine has a trend to draw", "select others, or print the table", argument="--out"
        )
    worst = of.ranked[0]
    figure = year_figure(year_of(of.history, worst.machine, worst.trend))
    save(out, lambda partial: save_svg(figure, partial), force=force)


def _write_csv(of: Assessment, path: Path) -> None:
    import csv

    rows = [_row(of, ranked) for ranked in of.ranked]
    flat = [{key: value for key, value in row.items() if not isinstance(value, list)} for row in rows]
    for row, own in zip(flat, rows):
        row["significant"] = str(own["significant"]).lower()
        row["changes"] = "; ".join(f"{c['kind']} {c['date']}" for c in own["changes"])
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, flat[0] if flat else (), lineterminator="\n")
        table.writeheader()
        table.writerows(flat)


def _day(time_s: float) -> str:
    from livebode_plant.report.trend_words import day

    return day(time_s)


def write_hall_pages(
    lake: Lake, of: Selection, name: str, limit: float, language: str, out: Path, *, force: bool, as_json: bool
) -> Hall:
    """Write HTML and PDF with the trends of all quantities and machines, and print their names."""
    from livebode.core import document_function
    from livebode.language import in_language
    from livebode.records import to_json
    from livebode_plant.archive.contents import alarms_of, path_of, quarantine
    from livebode_plant.report.hall_report import Hall
    from livebode_plant.trending import assess, histories

    bad = [(path_of(row), str(row["sentence"])) for row in quarantine(lake)]
    title = name or of.below or Path(lake.url).name
    hall = Hall(title, assess(histories(lake, of), limit), bad, limit, *alarms_of(lake, of))
    with in_language(language):
        files, remark = document_function("files")(hall.document(datetime.now(UTC)), out, force=force)
    if as_json:
        print(to_json({"files": list(map(str, files))} | hall.plain()))
        return hall
    for line in filter(None, (*files, remark)):
        print(line)
    return hall
