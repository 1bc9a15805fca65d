"""Fits of the responses of several axes at once: much cheaper than one by one where each axis has few."""

from __future__ import annotations

from collections.abc import Sequence

from livebode.core import Emit, Parameters, Responses, ignore
from livebode.fitting.fitter import Fitter
from livebode.fitting.tasks import fitted_together


def fit_together(
    fitters: Sequence[Fitter], batches: Sequence[Responses], emits: Sequence[Emit] | None = None
) -> list[Parameters]:
    """Parameters of each batch, to rounding as `process` of its fitter gives them; a fitter may be there once.

    Fitters with the same model, lines and free parameters share the computation of their rows: a call for one row costs
    nearly what it costs for sixteen (`python -m bench.fits`).

    Parameters
    ----------
    fitters, batches
        One Fitter for each axis, and its new Responses, one or more.
    emits
        For each axis, what receives its events.

    Raises
    ------
    LivebodeError
        As `Fitter.process`; some of the other fitters may already have taken rows.

    Examples
    --------
    >>> from livebode.fitting import Fitter, TwoMass
    >>> fit_together([], [])
    []
    """
    emits = emits or [ignore] * len(fitters)
    parts: list[list[Parameters]] = [[] for _ in fitters]
    done = [0] * len(fitters)
    waiting = list(range(len(fitters)))
    while waiting:
        tasks = [fitters[i].task(batches[i][done[i] :]) for i in waiting]
        for i, task, found in zip(waiting, tasks, fitted_together(tasks)):
            parts[i].append(fitters[i].take(task, found, emits[i]))
            done[i] += len(task.responses)
        waiting = [i for i in waiting if done[i] < len(batches[i])]
    return [Parameters.join(one) for one in parts]
