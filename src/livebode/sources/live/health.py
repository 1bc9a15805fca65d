"""Health: how a live source is doing."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Health:
    """How a live source is doing.

    Parameters
    ----------
    connected
        Whether a connection stands.
    counts
        How often each kind of Event happened, as in `livebode.sources.live.KINDS`.
    lost
        Samples that did not come, of those whose number is known.
    silent_s
        Seconds since the last batch; None before the first.
    measured_hz
        Samples per second by the time of arrival since the first batch; None before the second.
    clock_offset_s
        The sender's clock at its sample 0, seconds since 1970; None where it sends no stamps.
    latency_s
        This computer's clock at the arrival of the newest batch less the sender's at its last sample; it means
        something where both clocks are synchronised.
    waiting_bytes
        Received and not yet tracked.
    waiting_s
        The same in seconds of the machine: the backlog.
    """

    connected: bool
    counts: dict[str, int]
    lost: int
    silent_s: float | None
    measured_hz: float | None
    clock_offset_s: float | None
    latency_s: float | None
    waiting_bytes: int
    waiting_s: float
