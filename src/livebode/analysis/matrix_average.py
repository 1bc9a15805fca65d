"""The averages of a matrix run, with a change of the machine in their bounds, from its record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.core import MatrixResponses, Responses
from livebode.fitting import MatrixDriftTest, Repetitions, matrix_with_drift
from livebode.records import RunRecord


def newest_average(run: RunRecord, newest: MatrixResponses) -> MatrixResponses:
    """The newest matrix of a run, as one row, with the change that the run found in its averages; else unchanged."""
    if not _has_changing_averages(run):
        return newest
    found = run.found
    experiments, window = found["experiments"], found["window"]
    span = window * (experiments["dwell_periods"] if experiments["number"] > 1 else 1)
    of = Repetitions.of_experiments(window, span, experiments["number"], experiments["memory"])
    test = MatrixDriftTest((len(run.lines), len(newest.outputs), len(newest.inputs)), run.lines.rate_hz, of)
    for part in run.undamaged(run.matrix_batches()):
        test.add(part)
    return matrix_with_drift(newest, test.result())


def _has_changing_averages(run: RunRecord) -> bool:
    tracking = run.summary.get("configuration", {}).get("tracking") or {}
    return bool(tracking.get("average") and (run.summary.get("drift") or {}).get("found"))


def entry_average(run: RunRecord, average: Responses) -> Responses:
    """The newest average of the view of one entry, of one row, as `newest_average`."""
    if run.selected is None or not _has_changing_averages(run):
        return average
    whole = RunRecord.open(run.path, matrix=True)
    parts = [part[part.sample == average.sample[0]] for part in whole.undamaged(whole.matrix_batches())]
    entry = newest_average(whole, MatrixResponses.join(parts)).entry(*run.selected)
    sigma, variation = (np.where(average.valid, part, np.nan) for part in (entry.sigma, entry.variation))
    return replace(average, sigma=sigma, variation=variation)
