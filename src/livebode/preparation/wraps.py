"""Outputs and schedules that are angles or counters which wrap."""

from __future__ import annotations

from livebode.configuration import Axis
from livebode.core import Channel, Event
from livebode.language import Message
from livebode.sources import Log, Wrap


def unwrapped(axis: Axis, log: Log) -> Log:
    """The recording with its outputs and its schedule unwrapped, if the configuration permits it."""
    signals = axis.signals
    names = [*signals.listed("output"), *([signals.schedule] if signals.schedule else [])]
    return log.unwrapping(log.search_wraps(names)) if axis.source.unwrap and not log.wraps else log


def wrap_events(log: Log) -> list[Event]:
    """An Event for each channel that is unwrapped."""
    channels = {channel.name: channel for channel in log.channels}
    return [
        Event("unwrapped", log.first, log.first / log.rate_hz, _message(channels[name], wrap), _facts(name, wrap))
        for name, wrap in log.wraps.items()
    ]


def _facts(name: str, wrap: Wrap) -> dict[str, object]:
    return {"channel": name, "turn": wrap.turn, "count": wrap.count}


def wrap_text(channel: Channel, wrap: Wrap) -> Message:
    """What wraps, and how often."""
    return Message(
        "{channel} wraps at {turn:.9g}{unit}, {times}",
        channel=repr(channel.name),
        turn=wrap.turn,
        unit=f" {channel.unit}" if channel.unit else "",
        times=Message("1 time") if wrap.count == 1 else Message("{times} times", times=wrap.count),
    )


def _message(channel: Channel, wrap: Wrap) -> Message:
    return Message("{wraps}: it is unwrapped; --no-unwrap leaves it as it is", wraps=wrap_text(channel, wrap))
