"""What a live source sends within some seconds, compared with the configuration."""

from __future__ import annotations

from typing import Any

from livebode.configuration import Axis
from livebode.core import SourceError, counted, nearest_name
from livebode.doctor.check import Check
from livebode.sources.live import LISTEN_S, LiveSource, Reach, Survey, heard_channels, make_source, unusable_words

_RATE_TOLERANCE = 0.1  # of the rate by arrivals, which come in batches
_UNUSABLE = ("wrong-rate", "layout-changed", "unit-changed", "malformed", "foreign")


def check_arrival(name: str, axis: Axis, reach: Reach) -> Check:
    """Listen to the source of an axis for three seconds: what came, from whom, and at which rate.

    Raises
    ------
    LivebodeError
        If the settings do not fit the kind of source.
    """
    keys: dict[str, Any] = {"timeout_s": LISTEN_S}
    if "client_id" in axis.source.model_fields_set:
        keys["client_id"] = None  # its stored messages are for the run
    source = make_source(axis.source.model_copy(update=keys))
    address = str(source.address)
    facts: dict[str, Any] = {"address": address, "listened_s": LISTEN_S}
    try:
        heard = heard_channels(source, LISTEN_S)
    except SourceError as error:
        return _without_samples(name, source, reach, error, facts | {"code": error.code})
    facts |= {"channels": [channel.name for channel in heard.channels], "senders": sorted(source.senders)}
    events = {event.kind: event.message for event in source.take_events() if event.kind in _UNUSABLE}
    if heard.block is None:
        why = "; ".join(events.values()) or "no samples"
        return Check(name, "failed", f"{address}: nothing usable came within {LISTEN_S:g} s: {why}", _REMEDY, facts)
    if (absent := _absent(axis, heard)) is not None:
        return Check(name, "failed", f"{address}: {absent.message}", absent.remedy, facts)
    return _judged(name, source, heard, events, facts)


_REMEDY = "compare [source] with the sender; `livebode inspect` with its url lists what it sends"


def _absent(axis: Axis, heard: Survey) -> SourceError | None:
    """The error of a channel of the configuration that does not come, and is not an expression of others."""
    names = [channel.name for channel in heard.channels]
    signals = axis.signals
    required = [name for role in ("excitation", "input", "output") for name in signals.listed(role)]
    for name in required:
        if name.isidentifier() and name not in names:
            return SourceError("channel-unknown", f"there is no channel {name!r}", nearest_name(name, names))
    return None


def _judged(name: str, source: LiveSource, heard: Survey, events: dict[str, str], facts: dict[str, Any]) -> Check:
    health = source.health
    measured_hz = None if source.on_demand or not source.paced else health.measured_hz
    facts |= {"measured_hz": measured_hz, "rate_hz": source.rate_hz, "lost": health.lost}
    assert heard.block is not None
    arrived = "" if measured_hz is None else f", {measured_hz:.4g}/s by their arrival"
    by = f" from {', '.join(facts['senders'])}" if facts["senders"] else ""
    names = ", ".join(facts["channels"])
    message = f"{source.address}: {counted(len(heard.block), 'sample')} of {names}{by} in {LISTEN_S:g} s{arrived}"
    if measured_hz is not None and abs(measured_hz / source.rate_hz - 1) > _RATE_TOLERANCE:
        remedy = "correct source.rate_hz or the sender; every frequency would be wrong by the same factor"
        return Check(name, "warning", f"{message}, but the rate is {source.rate_hz:g} Hz", remedy, facts)
    if health.lost or events:
        others = [f"{health.lost} samples were lost"] * bool(health.lost) + list(events.values())
        return Check(name, "warning", f"{message}; {'; '.join(others)}", _REMEDY, facts)
    return Check(name, "ok", message, facts=facts)


def _without_samples(name: str, source: LiveSource, reach: Reach, error: SourceError, facts: dict[str, Any]) -> Check:
    """Silence is a warning, since the machine may be off; what comes and cannot be used has failed."""
    senders = f" from {', '.join(sorted(source.senders))}" if source.senders else ""
    facts |= {"senders": sorted(source.senders), "malformed": len(source.unusable)}
    if source.unusable:
        trouble = unusable_words(source.unusable, source.trouble)
        message = f"{source.address}: what came{senders} within {LISTEN_S:g} s cannot be used: {trouble}"
        return Check(name, "failed", message, _REMEDY, facts)
    if error.code == "source.no-samples" and not source.senders:
        remedy = "check that the machine is on and sends to this address, its cable and the firewall"
        message = f"{reach.message}, but nothing came within {LISTEN_S:g} s"
        return Check(name, "warning", message, remedy, facts)
    return Check.of_error(name, error)
