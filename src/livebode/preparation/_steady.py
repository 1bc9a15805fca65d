"""What a run leaves out of a recording with a periodic excitation: its transient, and outlying periods."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode.core import Event
from livebode.estimation import Settings
from livebode.preparation.aligned import AlignedLog
from livebode.preparation.outlying import outlying_event, outlying_periods, outlying_samples
from livebode.preparation.transients import leading_transient, transient_event


@dataclass(frozen=True, eq=False)
class Steady:
    """First sample behind the transient, numbers of the samples to leave out, and the events."""

    first: int
    left_out: NDArray[np.int64]
    noticed: list[Event]


def steady(source: AlignedLog, settings: Settings) -> Steady:
    """What is steady in a recording, whose periods count from `source.first`."""
    window, begins, noticed = settings.lines.window, source.first, []
    if transient := leading_transient(source, settings):
        noticed.append(replace(transient_event(transient, settings), sample=begins))
    outlying = [m for m in outlying_periods(source, settings) if m >= transient]
    if outlying:
        noticed.append(outlying_event(outlying, settings, begins))
    return Steady(begins + transient * window, outlying_samples(outlying, window, begins), noticed)
