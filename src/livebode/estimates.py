"""The kinds of estimates, and the rules of each: what checks, processes, draws, shows, reports, fits and exports it.

A rule is named as "module:name" and loaded when it is used. A kind that lacks a rule does not offer that.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.core import ConfigError
from livebode.plugins import loaded, named, wings_left_out

RESPONSE = "response"
"""The kind of a run whose run.json names none of the others."""
MATRIX = "matrix"
_BELONGS = {MATRIX: "a list of channels in [signals]", "output_only": "the section [output_only]"}
"""What names the kinds of livebode's wings in a configuration."""

ESTIMATES: Mapping[str, Mapping[str, str]] = {
    RESPONSE: {
        "baseline": "livebode.monitoring:Baseline",
        "estimate": "livebode.runtime.single_response:SingleResponse",
        "recording": "livebode.runtime.recording:examined_recordings",
        "draw": "livebode.cli.pictures:draw_response",
        "show": "livebode.cli.pictures:show",
        "page": "livebode.dashboard.run_feed:views_of_response",
        "export": "livebode.cli.export_command:responses",
    },
}
"""Rules by kind; run.json of each but a response has the name of its kind as a key that is true."""


def kind_of(summary: Mapping[str, Any]) -> str:
    """The kind of a run with this run.json."""
    return next((kind for kind in {**named("estimates"), **_BELONGS} if summary.get(kind) is True), RESPONSE)


def rule(kind: str, name: str) -> Any:
    """The rule of a kind; None if it has none. ConfigError if the kind is not installed."""
    rules = named("estimates").get(kind)
    if rules is None:
        raise ConfigError(
            "value-invalid",
            f"{_BELONGS[kind]} belongs to a kind of estimate that is not installed",
            f"install the wing {' or '.join(wings_left_out('estimates'))} of livebode, or remove it",
            key=kind,
            value=kind,
            allowed=list(named("estimates")),
        )
    reference = rules.get(name)
    return None if reference is None else loaded(reference)
