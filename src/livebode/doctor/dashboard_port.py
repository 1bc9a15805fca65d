"""Whether the dashboard could listen."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.configuration import Axis, ServeSection
from livebode.core import LivebodeError
from livebode.dashboard import Serving, listening
from livebode.doctor.check import Check

NAME = "dashboard port"


def check_dashboard_port(axes: Mapping[str, Axis]) -> Check:
    """Whether [serve] can be used and its port is free; where no axis has it, the default port, as a warning."""
    described = next((axis.serve for axis in axes.values() if "serve" in axis.model_fields_set), None)
    section = described or ServeSection()
    facts = {"address": section.address, "port": section.port}
    try:
        with listening(Serving.of(section)):
            pass
    except LivebodeError as error:
        failed = Check.of_error(NAME, error)
        verdict = failed.verdict if described is not None else "warning"
        return Check(NAME, verdict, failed.message, failed.remedy, facts | failed.facts)
    return Check(NAME, "ok", f"{section.address} port {section.port} is free", facts=facts)
