"""The mean of many responses, with its bounds from their scatter."""

from __future__ import annotations

import numpy as np

from livebode.nouns import InputError, Responses


def mean_response(responses: Responses) -> Responses:
    """Mean of the valid responses at each line, as a batch of one.

    Windows that overlap count once: m windows that would fit side by side into the run make m − 1 degrees of freedom,
    and sigma² is the scatter of the responses over m. With fewer than two such windows sigma is the least of them.

    Bias: a machine that changes from response to response is averaged, and its change is in sigma. Of an estimate that
    averages over its periods already (`average`), take the newest response instead.

    Raises
    ------
    InputError
        If no line is ever valid.
    """
    use = responses.valid & np.isfinite(responses.value)
    count = np.count_nonzero(use, axis=0)
    if not count.any():
        raise InputError("none of the responses is valid at any line; there is nothing to fit")
    rows = np.flatnonzero(use.any(axis=1))
    step = np.median(np.diff(responses.sample[rows])) if len(rows) > 1 else responses.lines.window
    share = min(1.0, float(step) / responses.lines.window)
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.where(use, responses.value, 0).sum(axis=0) / count
        rest = np.where(use, np.abs(responses.value - value) ** 2, 0.0).sum(axis=0) / count
        windows = count * share
        scatter = np.sqrt(rest / (windows - 1))
        single = np.min(np.where(use & np.isfinite(responses.sigma), responses.sigma, np.inf), axis=0)
        several = windows >= 2
        sigma = np.where(several, scatter, np.where(np.isfinite(single), single, np.nan))
        dof = float(windows[several].min() - 1) if several.any() else float(np.max(responses.dof[rows]))
        coherence = np.nanmean(np.where(use, responses.coherence, 0.0), axis=0)
    last = responses[int(rows[-1]) : int(rows[-1]) + 1]
    return Responses(
        lines=responses.lines,
        value=value[np.newaxis],
        sigma=sigma[np.newaxis],
        dof=np.array([dof]),
        coherence=coherence[np.newaxis],
        valid=(count > 0)[np.newaxis],
        first=responses.first[rows[:1]],
        sample=last.sample,
        time_s=np.array([responses.time_s[rows].mean()]),
        schedule=np.array([responses.schedule[rows].mean()]),
        quantity=responses.quantity,
        unit=responses.unit,
    )
