"""What reports and compares runs of each kind of estimate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.estimates import RESPONSE, rule
from livebode.plugins import loaded

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
