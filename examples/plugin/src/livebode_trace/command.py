"""The command `livebode trace`, and the analysis `Run.analysis("trace-duration")`."""

from pathlib import Path
from typing import Annotated

import typer

import livebode
from livebode_trace.reader import TraceRecording


def trace_command(file: Annotated[Path, typer.Argument(help="The trace.", exists=True, dir_okay=False)]) -> None:
    """Print rate and channels of a trace."""
    trace = TraceRecording(file)
    channels = ", ".join(f"{column.name} [{column.unit}]" for column in trace.columns)
    print(f"{file}: {trace.rate_hz:g} Hz: {channels}")


def duration_s(run: livebode.Run) -> float:
    """Time between the first and the last response of a run, in seconds."""
    return float(run.responses.time_s[-1] - run.responses.time_s[0])
