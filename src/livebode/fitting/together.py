"""Fits of the responses of several axes at once: much cheaper than one by one where each axis has few."""

from __future__ import annotations

from collections.abc import Sequence

from livebode.core import Emit, Parameters, Responses, ignore
from livebode.fitting.fitter import FitTask, Fitter, fitted_together
from livebode.fitting.rows import FittedRows


def fit_each(
    fitters: Sequence[Fitter], batches: Sequence[Responses], emits: Sequence[Emit] | None = None
) -> tuple[dict[int, Parameters], dict[int, Exception]]:
    """Parameters of each batch by the position of its fitter, and the errors of the others, which disturb no fitter.

    The parameters are to rounding those of `process` of the fitter; a fitter may be there once. Fitters with the same
    model, lines and free parameters share the computation of their rows where NumPy fits them: a call for one row costs
    nearly what it costs for sixteen (`python -m bench.fits`).

    Parameters
    ----------
    fitters, batches
        One Fitter for each axis, and its new Responses, one or more.
    emits
        For each axis, what receives its events.

    Examples
    --------
    >>> fit_each([], [])
    ({}, {})
    """
    emits = emits or [ignore] * len(fitters)
    parts: list[list[Parameters]] = [[] for _ in fitters]
    done = [0] * len(fitters)
    errors: dict[int, Exception] = {}
    waiting = list(range(len(fitters)))
    while waiting:
        tasks: dict[int, FitTask] = {}
        for i in waiting:
            try:
                tasks[i] = fitters[i].task(batches[i][done[i] :])
            except Exception as error:
                errors[i] = error
        for i, rows in _fitted(tasks, errors).items():
            try:
                parts[i].append(fitters[i].finish(tasks[i], rows, emits[i]))
            except Exception as error:
                errors[i] = error
            done[i] += len(tasks[i].responses)
        waiting = [i for i in waiting if i not in errors and done[i] < len(batches[i])]
    whole = {i: own[0] if len(own) == 1 else Parameters.join(own) for i, own in enumerate(parts) if i not in errors}
    return whole, errors


def _fitted(tasks: dict[int, FitTask], errors: dict[int, Exception]) -> dict[int, FittedRows]:
    """The rows of all tasks at once; if that raises, of each by itself."""
    try:
        return dict(zip(tasks, fitted_together(list(tasks.values()))))
    except Exception:
        rows = {}
        for i, task in tasks.items():
            try:
                rows[i] = task.fitted()
            except Exception as error:
                errors[i] = error
        return rows
