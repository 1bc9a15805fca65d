"""The configuration of a run, read from its run.json."""

from __future__ import annotations

from typing import Any

from livebode.configuration.fit_section import FitSection
from livebode.configuration.loop_section import LoopSection
from livebode.configuration.machine_sections import MachineSection
from livebode.configuration.report_section import ReportSection
from livebode.core import RecordError, TypedTable, errors_of

_SECTIONS: dict[str, type[TypedTable]] = {
    "fit": FitSection, "loop": LoopSection, "report": ReportSection, "machine": MachineSection,
}  # fmt: skip


def recorded_configuration(summary: dict[str, Any]) -> dict[str, Any]:
    """The configuration without null values: in JSON, null is used for None and for infinity.

    >>> recorded_configuration({"configuration": {"tracking": {"hop": 5, "spikes": None}, "fit": None}})
    {'tracking': {'hop': 5}}

    Raises
    ------
    RecordError
        If a section that is used again is not in the form that a run writes.
    """
    found = dict(without_null(summary.get("configuration", {})))
    for name, section in _SECTIONS.items():
        try:
            section.model_validate(found.get(name, {}))
        except ValueError as error:
            wrong = errors_of(error)[0]
            place = ".".join(map(str, (name, *wrong["loc"])))
            raise RecordError(
                "unexpected-content",
                f"the configuration in run.json is invalid ({place}: {wrong['msg']})",
                "restore the file as the run wrote it",
                key=place,
            ) from None
    return found


def recorded_loop(summary: dict[str, Any]) -> LoopSection:
    """The [loop] with which a run was recorded; RecordError as of `recorded_configuration`.

    >>> recorded_loop({"configuration": {"loop": {"velocity": {"gain": 0.2, "rate_hz": 4000.0}}}}).velocity.gain
    0.2
    """
    return LoopSection.model_validate(recorded_configuration(summary).get("loop", {}))


def recorded_report(summary: dict[str, Any]) -> ReportSection:
    """The [report] with which a run was recorded; where it names no machine, with the path of [machine].

    >>> recorded_report({"configuration": {"machine": {"line": "2", "machine": "press"}}}).machine
    '2/press'
    """
    configuration = recorded_configuration(summary)
    report = ReportSection.model_validate(configuration.get("report", {}))
    path = MachineSection.model_validate(configuration.get("machine", {})).path
    return report if report.machine else report.over({"machine": path})


def without_null(values: dict[str, Any]) -> dict[str, Any]:
    """The values that are not null, also in inner tables."""
    kept = {name: value for name, value in values.items() if value is not None}
    return {name: without_null(value) if isinstance(value, dict) else value for name, value in kept.items()}
