"""Change: effect of an edited configuration on a running axis."""

from __future__ import annotations

from livebode.configuration import Axis, RecordSection
from livebode.core import ConfigError, Event
from livebode.dataclass import dataclass
from livebode.estimates import rule
from livebode.language import Message
from livebode.runtime.estimate import Estimate
from livebode.runtime.run_control import RunControl
from livebode.sources.live import LiveSource

_KIND = "configuration-applied"


@dataclass(frozen=True, eq=False)
class ChangeRequest:
    """Request to an axis: use other settings of the record, or continue in another run with another estimate."""

    sections: tuple[str, ...]
    record: RecordSection | None = None
    estimate: Estimate | None = None

    @property
    def event(self) -> Event:
        """The event that reports it."""
        sections = Message.conjunction(f"[{name}]" for name in self.sections)
        message = Message("{changed} changed: applied in place", changed=sections)
        if self.estimate is not None:
            message = Message("{changed} changed: applied in another run, from the next sample", changed=sections)
        return Event(_KIND, 0, 0.0, message, {"sections": list(self.sections)})

    def request(self, control: RunControl) -> None:
        """Send the request; the event goes to the current record."""
        if self.record is not None:
            control.limit_record(self.record)
        if self.estimate is not None:
            control.change(self.estimate, self.event)
        else:
            control.report(_KIND, self.event.message, **self.event.details)


def change_of(old: Axis, new: Axis, source: LiveSource | None) -> ChangeRequest | None:
    """The change from one configuration to the other; None if they are equal.

    Raises
    ------
    LivebodeError
        If the new one cannot be applied without losing samples, or does not fit the source.
    """
    if old == new:
        return None
    sections = tuple(name for name in type(new).model_fields if getattr(old, name) != getattr(new, name))
    if sections == ("publish",):
        return ChangeRequest(sections)
    if source is None and old.source.live:
        raise ConfigError(
            "change-too-early",
            "the live source has sent no samples yet, which are needed to check the new configuration",
            "wait for them and save the file again, or remove the axis",
            key="source",
        )
    if source is None:
        raise ConfigError(
            "change-needs-restart",
            "the configuration of a recording cannot be changed while it is tracked",
            "stop livebode and start it again",
            keys=list(sections),
        )
    if "source" in sections:
        raise ConfigError(
            "change-needs-restart",
            "[source] cannot be changed without losing samples",
            "stop livebode, or remove the axis and add it again with another name",
            keys=["source"],
        )
    if "serve" in sections:
        raise ConfigError(
            "change-needs-restart",
            "[serve] belongs to the whole session, and cannot be changed while it runs",
            "stop livebode first",
            keys=["serve"],
        )
    record, before = new.record or RecordSection(), old.record or RecordSection()
    if set(sections) <= {"record", "publish"} and record.samples == before.samples:
        return ChangeRequest(sections, record=record)
    return ChangeRequest(sections, estimate=rule(new.kind, "estimate").live(new, source))
