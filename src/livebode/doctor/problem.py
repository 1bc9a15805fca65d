"""What in an axis's configuration would be found only when it begins."""

from __future__ import annotations

from livebode.configuration.axis import Axis
from livebode.core import LivebodeError
from livebode.preparation.plan import live_follower


def problem_of(axis: Axis) -> LivebodeError | None:
    """Why it could not begin: its lines, loop or baseline; None where nothing is found, or it takes samples to tell."""
    try:
        if axis.monitoring.baseline is not None:
            from livebode.monitoring import Baseline  # with the simulation

            Baseline.load(axis.monitoring.baseline)
        if axis.source.url is not None and axis.source.rate_hz is not None:
            live_follower(axis, axis.source.rate_hz)
    except LivebodeError as error:
        return error
    return None
