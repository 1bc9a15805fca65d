"""UnevenTracker: spectra that were fitted at the times of uneven samples in, frequency responses with bounds out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.core import Stage
from livebode.estimation.spectra_tracker import SpectraTracker


class UnevenTracker(SpectraTracker):
    """A SpectraTracker for recordings whose channels have clocks of their own.

    What the uneven times add to the error of a spectrum differs from period to period, and is in sigma as all of the
    scatter is.
    """

    _stage = Stage("uneven-tracker", 1)
    _sentences: Mapping[str, str] = {
        "not-whole": "a window has too few samples of a channel",
        "implausible": "a spectrum is more than 1e8 times larger than all in the period before",
        "spike": "a window has a spike",
    }

    def found(self) -> dict[str, Any]:
        """The basis of the responses as plain data for a record."""
        return super().found() | {"from": "samples at their own times"}
