"""A report in the units of the drive: a servo in rpm and % of its rated torque, at every line."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from livebode.configuration import Axis, LimitSection, ReportSection
from livebode.core import Document, Picture, PrintedTable
from livebode.records import RunRecord
from livebode.runtime import Destination, run
from livebode_reports.run_report import run_report
from livebode_reports.svg import drawn
from tests.support.command import livebode
from tests.support.drive_exports import EXPORTS, RPM
from tests.support.reports import Page

MADE = datetime(2026, 11, 30, 12, tzinfo=UTC)
FACTORS = {"rpm": (RPM, "rpm/(N m)"), "% of the rated torque": (0.024 * RPM, "min-1/(%)")}


def parts(document: Document, kind: type, title: str) -> list:
    sections = (*document.sections, *document.appendix)
    return [part for section in sections if section.title == title for part in section.parts if isinstance(part, kind)]


def curve(picture: Picture | None, name: str) -> np.ndarray:
    """Frequency and magnitude of a curve of the picture."""
    assert picture is not None
    line = next(mark for mark in drawn(picture).panels[0].marks if getattr(mark, "name", "") == name)
    return np.column_stack([line.x, line.y])


def recorded(folder: Path, name: str) -> Path:
    export = EXPORTS[name]
    excitation, torque, output = export.names
    given = {
        "source": {"log": export.write(folder / "log.csv"), "units": dict(export.units)},
        "signals": {"excitation": excitation, "input": torque, "output": output},
        "fit": {"model": "two-mass"},
    }
    return run(Axis.of(given, "test"), Destination(folder / "run", lambda *_: None)).directory


@pytest.mark.parametrize("name", FACTORS)
def test_picture_and_table_are_the_response_times_the_factor(name: str, tmp_path: Path) -> None:
    directory, (factor, unit) = recorded(tmp_path, name), FACTORS[name]
    above = 20 * np.log10(factor)
    limits = [LimitSection(quantity="|G|", max=60)]
    si, of_drive = (
        run_report(directory, made=MADE, header=ReportSection.model_validate({"units": units, "limits": limits}))
        for units in ("si", "drive")
    )
    for curve_name in ("newest", "fit"):
        difference = curve(of_drive.picture, curve_name) - curve(si.picture, curve_name)
        np.testing.assert_allclose(difference, np.tile([0, above], (len(difference), 1)), atol=1e-9)
    (table,), (table_si,) = (parts(document, PrintedTable, "Frequency response") for document in (of_drive, si))
    assert table.headings[1] == f"dB re 1 {unit}"
    assert len(table.rows) == len(RunRecord.open(directory).lines)
    for row, row_si in zip(table.rows, table_si.rows):
        assert float(row[1]) - float(row_si[1]) == pytest.approx(above, abs=0.011)
        assert (row[0], *row[2:]) == (row_si[0], *row_si[2:])
    assert of_drive.picture is not None
    assert of_drive.picture.caption.count(f"1 rad/s/(N m) = {factor:.5g} {unit}, {above:+.2f} dB") == 1
    # Parameters and limits are in SI units.
    for title in ("Parameters", "Limits"):
        assert parts(of_drive, PrintedTable, title) == parts(si, PrintedTable, title) != []


def test_a_template_sets_the_units_and_a_run_in_si_units_has_no_other(tmp_path: Path) -> None:
    directory, template = recorded(tmp_path, "rpm"), tmp_path / "template.toml"
    for units, words in (("drive", "dB re 1 rpm/(N m)"), ("si", "dB re 1 rad/s/(N m)")):
        template.write_text(f'[report]\nunits = "{units}"\n', encoding="utf-8")
        done = livebode("report", directory, "--template", template)
        assert done.code == 0, done.err
        assert words in Page((directory / "report.html").read_text("utf-8")).text
    template.write_text('[report]\nunits = "rpm"\n', encoding="utf-8")
    refused = livebode("report", directory, "--template", template)
    assert (refused.code, "report.units" in refused.err) == (2, True), refused.err
    (tmp_path / "SI").mkdir()
    plain = run_report(recorded(tmp_path / "SI", "SI"), made=MADE, header=ReportSection(units="drive"))
    assert plain.picture is not None
    assert "drive" not in plain.picture.caption
