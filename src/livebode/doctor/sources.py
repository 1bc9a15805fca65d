"""Whether each axis's source can be used, and answers."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

from livebode.configuration import Axis
from livebode.core import LivebodeError, counted
from livebode.doctor.check import Check
from livebode.doctor.recordings import check_recording
from livebode.runtime import RecordedRun
from livebode.sources.live import make_source

NAME = "source"
_AT_ONCE = 16


def check_sources(axes: Mapping[str, Axis]) -> list[Check]:
    """A check for each axis; a single one where there is none. At most a connection is opened, and closed again."""
    if not axes:
        return [Check(NAME, "not applicable", "there is no valid configuration of an axis that still runs")]
    with ThreadPoolExecutor(_AT_ONCE, "livebode doctor") as threads:
        return list(threads.map(_check, axes, axes.values()))


def _check(of: str, axis: Axis) -> Check:
    name, settings = f"{NAME} of {of}" if of else NAME, axis.source
    try:
        if settings.replay is not None:
            samples = RecordedRun(settings.replay).samples
            return Check(name, "ok", f"{settings.replay} has {counted(samples, 'recorded sample')}")
        if settings.url is None:
            found = [check_recording(name, axis, path) for path in settings.logs]
            return next((check for check in found if check.verdict != "ok"), found[0])
        reach = make_source(settings).reach()
        return Check(name, reach.verdict, reach.message, reach.remedy, reach.facts)
    except LivebodeError as error:
        return Check.of_error(name, error)
