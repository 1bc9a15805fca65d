"""The commands and documents of this wing."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.cli import COMPARE, RESULTS, Command

COMMANDS: Mapping[str, Command] = {
    "report": Command(
        "Write the measurement and its results as report.html and report.pdf, with the verdict on page 1.",
        "livebode_reports.cli.report_command:report_command",
        panel=RESULTS,
    ),
    "compare": Command(
        "Find the lines, parameters and margins that differ between two runs, with amounts and bounds.",
        "livebode_reports.cli.compare_command:compare_command",
        panel=COMPARE,
    ),
}

DOCUMENTS: Mapping[str, str] = {
    "files": "livebode_reports.files:write_documents",
    "comparison": "livebode_reports.files:comparison_page",
}
