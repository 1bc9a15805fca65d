"""The mean responses of a run at places of its schedule."""

from __future__ import annotations

import numpy as np

from livebode.core import Responses
from livebode.fitting import mean_response

_PLACES = 12


def by_place(responses: Responses) -> Responses:
    """The mean response at each of twelve places of the schedule; one row without a schedule."""
    use = np.flatnonzero(responses.valid.all(axis=1) & np.isfinite(responses.schedule))
    if not use.size:
        return mean_response(responses)
    at = responses.schedule[use]
    edges = np.linspace(at.min(), at.max(), _PLACES + 1)
    place = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, _PLACES - 1)
    groups = [use[place == i] for i in range(_PLACES)]
    return Responses.join([mean_response(responses[group]) for group in groups if group.size])
