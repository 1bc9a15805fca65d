"""Results of the monitoring of a run, as findings of a verdict."""

from __future__ import annotations

from typing import Any

from livebode.core import Event, Finding
from livebode.language import recorded, tr, trn, worded
from livebode.monitoring import result_tone
from livebode.records import RunRecord
from livebode_reports.event_summary import EventSummary

_ACTIVE_MAX = 5


def alarms(run: RunRecord, event_summary: EventSummary) -> tuple[Finding, ...]:
    """The summary of the monitoring, then the active alarms."""
    monitoring: dict[str, Any] = run.summary.get("monitoring", {})
    if "message" not in monitoring or (run.finished and monitoring.get("baseline") is None):
        return (_so_far(run, event_summary),)
    active = bool(monitoring.get("standing"))
    tone = result_tone(monitoring, active=active)
    latest = _newest(event_summary)[-_ACTIVE_MAX:] if active else []
    return (
        Finding(tone, worded(recorded(monitoring.get("words", {}), monitoring["message"]))),
        *(Finding("alarm", worded(event.words)) for event in latest),
    )


def _newest(event_summary: EventSummary) -> list[Event]:
    """The newest report of each change that has not cleared."""
    found: dict[tuple[str, str], Event] = {}
    for event in event_summary.in_full:
        key = str(event.details.get("what")), str(event.details.get("place_m"))
        if event.kind in ("change", "change-corrected"):
            found[key] = event
        elif event.kind == "change-cleared":
            found.pop(key, None)
    return list(found.values())


def _so_far(run: RunRecord, event_summary: EventSummary) -> Finding:
    """The changes so far, if run.json does not contain a summary yet."""
    if run.finished:
        return Finding(
            "open", tr("Changes are not assessed: the run was not compared with a baseline of the healthy machine.")
        )
    came, cleared = event_summary.count("change"), event_summary.count("change-cleared")
    if not came:
        text = tr("No change was reported so far; the final verdict is available at the end of the run.")
        return Finding("open", text)
    message = trn(
        "So far {n:,} change reported, {cleared} cleared.", "So far {n:,} changes reported, {cleared} cleared.", came,
        cleared=cleared,
    )  # fmt: skip
    return Finding("alarm" if came > cleared else "check", message)
