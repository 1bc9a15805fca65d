"""Fits of several axes at once, with the quantities derived from them and the margins."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from livebode.core import Event, Parameters, Responses
from livebode.fitting import fit_each
from livebode.runtime import Fits

Fitted = tuple[tuple[Parameters, ...], list[Event]]


def process_together(fits: Sequence[Fits], batches: Sequence[Responses]) -> list[Fitted | Exception]:
    """Result of `Fits.process` of each axis for its new responses, bit for bit; axes that are alike share the work.

    Of an axis whose fit raises, the error instead; it disturbs no other axis.

    A process with many axes should collect their responses: derived quantities and margins of one row cost nearly what
    they cost for sixteen (`python -m bench.fits`).
    """
    fitters = [one.fitter(batch.unit) for one, batch in zip(fits, batches)]
    events: list[list[Event]] = [[] for _ in fits]
    found, errors = fit_each(fitters, batches, [of_axis.append for of_axis in events])
    alike: dict[object, list[int]] = {}
    for i, parameters in found.items():
        fits[i].take(parameters, batches[i])
        alike.setdefault((fitters[i].identity, fits[i].loop, batches[i].lines, batches[i].unit), []).append(i)
    around: dict[int, tuple[Parameters, ...]] = {}
    for members in alike.values():
        of = [(fits[i], found[i], batches[i]) for i in members]
        try:
            around |= zip(members, _around(of))
        except Exception:  # which of them it is shows only alone
            for i, one in zip(members, of):
                try:
                    around |= zip([i], _around([one]))
                except Exception as error:
                    errors[i] = error
    return [errors[i] if i in errors else ((found[i], *around[i]), events[i]) for i in range(len(fits))]


def _around(members: Sequence[tuple[Fits, Parameters, Responses]]) -> list[tuple[Parameters, ...]]:
    """`Fits.around` of axes that are alike, as one computation."""
    if len(members) == 1:
        ((one, parameters, batch),) = members
        return [one.around(parameters, batch)]
    fits, found, batches = zip(*members)
    ends = np.cumsum([0, *map(len, found)]).tolist()
    every = fits[0].around(Parameters.join(found), Responses.join(batches))
    return [tuple(one[a:b] for one in every) for a, b in pairwise(ends)]
