"""Fits of several axes at once, with the quantities derived from them and the margins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.core import Event, Parameters, Responses
from livebode.fitting import fit_together
from livebode.runtime.fits import Fits

Fitted = tuple[tuple[Parameters, ...], list[Event]]


def process_together(fits: Sequence[Fits], batches: Sequence[Responses]) -> list[Fitted]:
    """Result of `Fits.process` of each axis for its new responses, bit for bit; axes that are alike share the work.

    A process with many axes should collect their responses, since a call for one row costs nearly what it costs for
    sixteen (`python -m bench.fits`).
    """
    fitters = [one.fitter(batch.unit) for one, batch in zip(fits, batches)]
    events: list[list[Event]] = [[] for _ in fits]
    found = fit_together(fitters, batches, [of_axis.append for of_axis in events])
    alike: dict[object, list[int]] = {}
    for i, (one, batch) in enumerate(zip(fits, batches)):
        one.take(found[i], batch)
        alike.setdefault((fitters[i].identity, one.loop, batch.lines, batch.unit), []).append(i)
    around: dict[int, tuple[Parameters, ...]] = {}
    for members in alike.values():
        values, responses = Parameters.join([found[i] for i in members]), Responses.join([batches[i] for i in members])
        ends = np.cumsum([0, *(len(found[i]) for i in members)]).tolist()
        every = fits[members[0]].around(values, responses)
        around.update({i: tuple(one[a:b] for one in every) for i, a, b in zip(members, ends, ends[1:])})
    return [((found[i], *around[i]), events[i]) for i in range(len(fits))]
