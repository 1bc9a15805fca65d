"""The live source: sends a trace as the controller sent it, a batch of 10 ms at a time."""

from pathlib import Path
from typing import ClassVar

import numpy as np

from livebode.core import Channel
from livebode.sources.live import Batch, LiveSource, Reach
from livebode_trace.reader import TraceRecording

BATCH_S = 0.01


class TraceSource(LiveSource):
    """A source has one method, `_receive`; `reach` is for `livebode doctor`."""

    format: ClassVar[str] = "trace"
    waits: ClassVar[bool] = True

    def reach(self) -> Reach:
        """Whether the trace is there."""
        if Path(self.address.path).exists():
            return Reach("ok", f"{self.address} is there")
        return Reach("failed", f"{self.address}: there is no such file", "check source.url")

    def _receive(self) -> bool:
        """Connect, and deliver batches until it is stopped or the sender ends."""
        trace = TraceRecording(Path(self.address.path))
        rate_hz = trace.rate_hz or 0.0
        channels = tuple(Channel(column.name, column.unit) for column in trace.columns)
        self._established()
        first = 0
        for chunk in trace.chunks(trace.columns, max(1, round(BATCH_S * rate_hz))):
            if self._stop.wait(len(chunk[0]) / rate_hz):
                return False
            self._deliver(Batch(first, np.stack(chunk), channels, rate_hz))
            first += len(chunk[0])
        return True
