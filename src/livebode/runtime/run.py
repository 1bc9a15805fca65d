"""`run`: the entrance to the run loop for an axis."""

from __future__ import annotations

from livebode.configuration.axis import Axis
from livebode.core import ConfigError
from livebode.runtime.destination import Destination
from livebode.runtime.recording import run_recording
from livebode.runtime.recordings import run_recordings
from livebode.runtime.run_control import RunControl
from livebode.runtime.run_loop import Outcome


def run(axis: Axis, to: Destination, control: RunControl | None = None) -> Outcome:
    """Track a recording or several, or a machine while it works, and write a run directory.

    A recording is written in one piece, or in segments if the axis has a [record]. A live source is always recorded in
    segments, and ends with its sender or when `control` requests it; all received samples are then recorded. The same
    axis in the same directory continues an unfinished run: a live source with the sender's next sample, where missing
    samples are a gap whose length follows from the sender's numbers. A change of the configuration by `control`
    finishes the run, and a new run next to it (NAME-2 and so on) continues with the next sample of the same source; the
    result is that of the last run. A machine that is not switched on yet is waited for, and reported after `timeout_s`.

    Raises
    ------
    LivebodeError
        For any error in the recording or the configuration, if the machine rejects the connection, or if the run is
        stopped before samples arrive. In one piece nothing is written; in segments what was recorded so far remains.
    StoppedError
        If `control` ends a recording before its end; the directory is as for an error.
    """
    if axis.output_only is not None:
        raise ConfigError(
            "key-conflict",
            "an axis with [output_only] cannot run together with others",
            "run its recording alone",
            key="output_only",
        )
    control = control or RunControl()
    if axis.source.live:
        from livebode.runtime.live import run_live

        return run_live(axis, to, control)
    if axis.signals.is_matrix:
        from livebode.runtime.matrix_recording import run_matrix_recording

        return run_matrix_recording(axis, to, control)
    recording = run_recordings if len(axis.source.logs) > 1 else run_recording
    return recording(axis, to, control)
