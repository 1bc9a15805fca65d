"""The trends of a hall on one page, which `livebode archive trend` writes where no quantity is named."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from livebode_plant.lake import Lake
    from livebode_plant.trending import Selection


def write_hall_pages(
    lake: Lake, of: Selection, name: str, limit: float, language: str, out: Path, *, force: bool, as_json: bool
) -> None:
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
        return
    for line in filter(None, (*files, remark)):
        print(line)
