"""The data of the report of a whole matrix run, read once from its directory."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from livebode.configuration import ReportSection, recorded_configuration, recorded_report
from livebode.core import MatrixResponses, SignalError
from livebode.records import RunRecord
from livebode_reports.event_summary import EventSummary
from livebode_reports.report_data import Extent, RunData


@dataclass(frozen=True, eq=False, kw_only=True)
class MatrixReportData(RunData):
    """The data of a matrix run.

    Attributes
    ----------
    newest
        The newest matrix with a valid column, as one row; with tracking.average it is from all repetitions.
    """

    newest: MatrixResponses


def read_matrix(directory: Path, header: ReportSection | None = None) -> MatrixReportData:
    """Read a matrix run in parts; `header` replaces the [report] with which it was recorded.

    Raises
    ------
    RecordError, SignalError
        If the directory is not a matrix run, cannot be read, or has no valid column.
    """
    run = RunRecord.open(directory, matrix=True)
    newest: MatrixResponses | None = None
    count, incomplete, begin_s, end_s = 0, 0, inf, -inf
    for part in run.matrix_batches():
        valid = part.valid.any(axis=(1, 2))
        count += len(part)
        incomplete += int(np.count_nonzero(~part.valid.all(axis=(1, 2))))
        if valid.any():
            newest = part.newest()
            begin_s = min(begin_s, float(part.time_s[valid].min()))
            end_s = max(end_s, float(part.time_s[valid].max()))
    if newest is None:
        raise SignalError(
            "no-valid-response",
            "none of the matrices has a valid column at any line",
            "compare [experiments] with the recording: dwell_periods, settle_periods, start",
        )
    return MatrixReportData(
        run=run,
        configuration=recorded_configuration(run.summary),
        extent=Extent(count, incomplete, (begin_s, end_s), int(newest.sample[0])),
        event_summary=EventSummary.of(run.each_event_and_damage()),
        header=recorded_report(run.summary) if header is None else header,
        newest=newest,
    )
