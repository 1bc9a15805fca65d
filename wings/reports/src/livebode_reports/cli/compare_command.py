"""`livebode compare`: differences between two runs of a machine."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from math import inf
from pathlib import Path
from typing import Annotated, Any

import typer

from livebode.cli import Entry, Json, NextCommand, ReportLanguage, with_keys
from livebode.core import UsageError
from livebode.locations import location
from livebode_reports.cli.report_options import FIRST_PAGE, Appendix, Ask, Template, header


@with_keys(report=FIRST_PAGE)
def compare_command(
    before: Annotated[Path, typer.Argument(metavar="BEFORE", help="Run directory.", parser=location)],
    after: Annotated[
        Path, typer.Argument(metavar="AFTER", help="Directory of a later run with the same signals.", parser=location)
    ],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write FILE.html and FILE.pdf.")] = None,
    ignore_below: Annotated[
        str | None,
        typer.Option(metavar="SIZE", help="Smallest change of a line that matters, as 0.5dB or 5%. \\[default: any]"),
    ] = None,
    entry: Entry = None,
    gantry: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Of two matrix runs: the gantry in TOML, to name the part that changed.",
            parser=location,
        ),
    ] = None,
    cart: Annotated[
        str | None,
        typer.Option(metavar="BEFORE:AFTER", help="With --gantry: places of its cart in m. \\[default: as described]"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    template: Template = None,
    *,
    sections: dict[str, dict[str, Any]],
    language: ReportLanguage = None,
    ask: Ask = False,
    appendix: Appendix = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Find the lines, parameters and margins that differ between two runs, with amounts and bounds.

    A line differs if chance does not explain it; with --ignore-below only if |after/before − 1| is that large too.
    Runs with a schedule, such as a position, are compared by place and direction, and over all places. Of two matrix
    runs all entries are compared, or one of them (--entry). The first page of the files is as in `livebode report`;
    limits apply to AFTER.
    """
    from livebode.configuration import recorded_report
    from livebode.language import in_language
    from livebode.records import to_json
    from livebode_reports.compare_report import Comparison, comparison_of
    from livebode_reports.files import write_documents

    if out is None and (template is not None or ask or appendix or language or sections):
        raise _needs_out()
    kind = Comparison if entry is not None else comparison_of(before, after)
    if kind is Comparison and (gantry is not None or cart is not None):
        raise _one_response()
    more = _described(gantry, cart) if entry is None else {"entry": entry}
    comparison = kind.of(before, after, ignore_below=_share(ignore_below), **more)
    files: list[Path] = []
    remark = ""
    if out is not None:
        first = header(recorded_report(comparison.later.summary), template, ask, sections.get("report", {}))
        with in_language(language or first.language or "en"):
            document = comparison.document(datetime.now(UTC), header=first, appendix=appendix)
            files, remark = write_documents(document, out, force=force)
    if as_json:
        print(to_json(comparison.plain()))
        return None
    for line in (*comparison.printed, *filter(None, (*files, remark))):
        print(line)
    return NextCommand("view", before, after)


def _one_response() -> UsageError:
    return UsageError(
        "conflict",
        "a gantry is compared by all entries of two matrix runs",
        "leave out --gantry and --cart, or --entry",
        argument="gantry",
    )


def _described(gantry: Path | None, cart: str | None) -> dict[str, Any]:
    """The gantry, and places of its cart."""
    from livebode.estimates import MATRIX, rule

    if gantry is None:
        if cart is not None:
            raise UsageError("missing", "--cart belongs to --gantry, which is missing", "add --gantry FILE",
                             argument="gantry")  # fmt: skip
        return {}
    if cart is None:
        return {"gantry": rule(MATRIX, "machine")(gantry)}
    try:
        before, after = (float(part) for part in cart.split(":"))
    except ValueError:
        raise UsageError(
            "unreadable",
            f"the places {cart!r} are not BEFORE:AFTER in m",
            "write for example 0.2:0.3",
            argument="cart",
            value=cart,
        ) from None
    return {"gantry": rule(MATRIX, "machine")(gantry), "cart_m": (before, after)}


def _needs_out() -> UsageError:
    return UsageError(
        "missing",
        "the options of the first page belong to the files of --out, which is missing",
        "add --out FILE",
        argument="out",
    )


def _share(text: str | None) -> float:
    """|ratio − 1| of a size in dB or %."""
    if text is None:
        return 0.0
    number, unit = re.fullmatch(r"\s*([0-9.eE+-]*)\s*(.*?)\s*", text).groups()  # type: ignore[union-attr]
    try:
        size = float(number)
    except ValueError:
        size = -1.0
    if unit not in ("dB", "%") or not 0 <= size < inf:
        raise UsageError(
            "unreadable",
            f"the size {text!r} is not a number of dB or %",
            "write for example 0.5dB or 5%",
            argument="ignore_below",
            value=text,
        )
    return float(10 ** (size / 20) - 1) if unit == "dB" else size / 100
