"""The analyses of a run that this wing adds, and how the report and the page show their results."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.analysis import Analysis

ANALYSES: Mapping[str, Analysis] = {
    "margins": Analysis(
        "livebode_control.run_analyses:loop_margins",
        filter="livebode_control.margins.loop_margins:plain_filter",
        loop="livebode_control.margins.section:loop_section",
    ),
    "loop-check": Analysis("livebode_control.run_analyses:loop_check"),
    "proposal": Analysis(
        "livebode_control.run_analyses:proposal",
        section="livebode_control.proposal.section:proposed_controller",
    ),
    "validation": Analysis(
        "livebode_control.run_analyses:validation",
        test="livebode_control.validation.section:validation_report",
    ),
    "friction": Analysis("livebode_control.run_analyses:friction"),
    "orders": Analysis("livebode_control.run_analyses:orders"),
}
PAGES: Mapping[str, str] = {"whatIf": "livebode_control.trial.loop_trials:LoopTrials"}
"""What it adds to the page of a run."""
