"""`livebode archive report`: a hall on one page."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from livebode.cli import Json, ReportLanguage
from livebode_plant.cli.archive.options import LakeOf
from livebode_plant.cli.archive.selection import Limit, SelectionOptions, with_selection


@with_selection("below", "since", "until", "covariate", "recipe")
def report_command(
    archive: LakeOf,
    chosen: SelectionOptions,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Write FILE.html and FILE.pdf.", show_default=True)] = Path(
        "hall-report"
    ),
    name: Annotated[str, typer.Option(metavar="TEXT", help="Title. \\[default: name of the lake]")] = "",
    limit: Limit = 10.0,
    language: ReportLanguage = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    as_json: Json = False,
) -> None:
    """Write the trends of all quantities and machines as one page, the worst machine first.

    It contains alarms of recordings that were compared with a baseline, significant changes in words, pictures of the
    worst machines, machines without data, and what was not assessed and why. The PDF needs the extra `pdf`.
    """
    from livebode.cli import write_documents
    from livebode.language import in_language
    from livebode.records import to_json
    from livebode_plant.archive.archive_settings import lake_url
    from livebode_plant.archive.contents import alarms_of, path_of, quarantine
    from livebode_plant.lake import Lake
    from livebode_plant.report.hall_report import Hall
    from livebode_plant.trending import assess, histories

    lake = Lake(lake_url(archive))
    of = chosen.selection()
    bad = [(path_of(row), str(row["sentence"])) for row in quarantine(lake)]
    title = name or of.below or Path(lake.url).name
    hall = Hall(title, assess(histories(lake, of), limit), bad, limit, *alarms_of(lake, of))
    with in_language(language or "en"):
        files, remark = write_documents(hall.document(datetime.now(UTC)), out, force=force)
    if as_json:
        print(to_json({"files": list(map(str, files))} | hall.plain()))
        return
    for line in filter(None, (*files, remark)):
        print(line)
