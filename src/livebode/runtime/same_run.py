"""Whether a run can be continued: the same configuration, by a livebode that reads the states of the one before it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from livebode.configuration import NOT_RECORDED, Axis, without_null
from livebode.core import RecordError

EARLIER = "earlier_versions"
_CHANGEABLE = {"report", "record"}  # texts, and the segmentation of the record
_LEARNED = {"motion", "judged"}


def check_same_run(
    path: Path, before: Mapping[str, Any], now: Mapping[str, Any], states: Collection[str], parts: Collection[str]
) -> None:
    """Whether the unfinished run that `before` describes can be continued as `now` describes it.

    Settings and findings that only one of two versions of livebode knows do not count, as long as such a setting has
    its default.

    Parameters
    ----------
    path
        Directory of the run.
    before, now
        run.json at both beginnings.
    states, parts
        Names of the stored states, and of the parts of the run that need one.

    Raises
    ------
    RecordError
        If it was started with another configuration, or its states are those of another version.
    """
    known = before["found"].keys() & now["found"].keys() - _LEARNED
    findings = all(before["found"][name] == now["found"][name] for name in known)
    writer, reader = (of.get("versions", {}).get("livebode", "") for of in (before, now))
    if not findings or _configuration(before) != _configuration(now):
        by = f" by livebode {writer} (this is {reader})" if writer != reader else ""
        raise RecordError(
            "configuration-differs",
            f"the unfinished run in {str(path)!r} was started{by} with another configuration",
            "use that one again, choose another directory, or replace the run with force",
            path=str(path),
        )
    if set(states) != set(parts):
        differ = ", ".join(sorted(set(states) ^ set(parts)))
        raise RecordError(
            "states-differ",
            f"livebode {writer} recorded the unfinished run in {str(path)!r} with other states than this livebode "
            f"{reader} needs: {differ}",
            f"finish the run with livebode {writer}, choose another directory, or replace the run with force",
            path=str(path),
            written_by=writer,
            names=sorted(set(states) ^ set(parts)),
        )


def continues(summary: Mapping[str, Any], axis: Axis) -> bool:
    """Whether a run with this run.json is unfinished and of this axis, as the same command would continue it."""
    if summary.get("record", {}).get("finished", True):
        return False
    now = axis.model_dump(mode="json", exclude=NOT_RECORDED, by_alias=True)
    return _configuration(summary) == _configuration({"configuration": now})


def earlier_versions(before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, Any]:
    """Entry of run.json on the versions that recorded it before this one; none if there is only one."""
    earlier = list(before.get(EARLIER, []))
    if before.get("versions", {}) != now.get("versions", {}):
        earlier.append(before.get("versions", {}))
    return {EARLIER: earlier} if earlier else {}


def _configuration(summary: Mapping[str, Any]) -> tuple[dict[str, Any], bool]:
    """What must not change: without defaults, because a later version has more of them."""
    given = without_null(summary["configuration"])
    samples = bool((given.get("record") or {}).get("samples"))
    given = {name: value for name, value in given.items() if name not in _CHANGEABLE}
    try:
        axis = Axis.model_validate(given)
    except ValueError:  # a demo, or another version has other keys
        return given, samples
    return axis.model_dump(mode="json", by_alias=True, exclude_defaults=True), samples
