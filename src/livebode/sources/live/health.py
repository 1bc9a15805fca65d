"""Health: state of a live source."""

from __future__ import annotations

from livebode.dataclass import dataclass


@dataclass(frozen=True)
class Health:
    """State of a live source.

    Parameters
    ----------
    connected
        Whether there is a connection.
    counts
        Number of Events of each kind in `livebode.sources.live.KINDS`.
    lost
        Samples known to be lost.
    silent_s
        Seconds since the last batch; None before the first.
    measured_hz
        Samples per second by the time of arrival since the first batch; None before the second.
    clock_offset_s
        The sender's clock at its sample 0, seconds since 1970; None where it sends no stamps.
    latency_s
        This computer's clock at the arrival of the newest batch minus the sender's clock at its last sample; meaningful
        only if both clocks are synchronised.
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
