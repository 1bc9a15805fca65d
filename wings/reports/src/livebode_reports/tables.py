"""The commands and documents of this wing, and what reports each kind of estimate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.cli import Command
from livebode.estimates import RESPONSE, rule
from livebode.plugins import loaded

COMMANDS: Mapping[str, Command] = {
    "report": Command(
        "Write the measurement and its results as report.html and report.pdf, with the verdict on page 1.",
        "livebode_reports.report_command:report_command",
    ),
    "compare": Command(
        "Find the lines, parameters and margins that differ between two runs, with amounts and bounds.",
        "livebode_reports.compare_command:compare_command",
    ),
}

DOCUMENTS: Mapping[str, str] = {
    "files": "livebode_reports.files:write_documents",
    "comparison": "livebode_reports.compare_report:comparison_page",
}

_KINDS: Mapping[str, Mapping[str, str]] = {
    RESPONSE: {
        "report": "livebode_reports.run_report:accepted_report",
        "compare": "livebode_reports.compare_report:Comparison",
    },
    "matrix": {
        "report": "livebode_reports.matrix_report:matrix_report",
        "compare": "livebode_reports.matrix_comparison:MatrixComparison",
    },
}


def rule_of(kind: str, name: str) -> Any:
    """What reports or compares runs of a kind: from here, else from the row of the kind; None if it has none."""
    own = _KINDS.get(kind)
    return rule(kind, name) if own is None else loaded(own[name])
