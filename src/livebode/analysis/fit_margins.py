"""Margins of one fit, with bounds that contain every model that its lines do not tell apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.analysis._margins import Margins
from livebode.analysis.margin_reading import margins
from livebode.analysis.open_loop import OpenLoop
from livebode.core import Loop
from livebode.fitting import Fit


def margins_of(fit: Fit, loop: Loop) -> Margins:
    """Margins of a fit, one row, by `Fit.with_unseen` and by each of its competitors.

    The square of sigma is the mean over the competitors, by their weights, of the square of a competitor's own sigma
    and of the distance of its margin: beyond the lines, competitors that fit alike differ. The loop was measured while
    it was closed, so one that would make it unstable is not one of them.
    """
    average = fit.with_unseen()
    around = OpenLoop(average.model, loop, fit.rate_hz, fit.hold)
    return among_competitors(margins(average.parameters, around, fit.band_hz), fit, loop)


def among_competitors(read: Margins, fit: Fit, loop: Loop) -> Margins:
    """Margins whose last row is of this fit, with the bounds of `margins_of` there."""
    if fit.competitors is None or not read.ok[-1]:
        return read
    model, rows, weight = fit.competitors
    each = margins(rows, OpenLoop(model, loop, fit.rate_hz, fit.hold), fit.band_hz)
    wider = {}
    for value, sigma in (("value", "sigma"), ("frequency_hz", "frequency_sigma_hz")):
        middle, columns = getattr(read, value)[-1], np.array(getattr(read, sigma))
        at, own = getattr(each, value), getattr(each, sigma)
        known = each.ok[:, np.newaxis] & np.isfinite(at) & np.isfinite(own)
        share = np.where(known, weight[:, np.newaxis], 0.0)
        total = share.sum(axis=0)
        with np.errstate(invalid="ignore"):
            square = np.where(known, own**2 + (at - middle) ** 2, 0.0)
        spread = np.sqrt(np.sum(share * square, axis=0) / np.where(total > 0, total, 1.0))
        columns[-1] = np.where(np.isfinite(middle) & (total > 0), spread, columns[-1])
        wider[sigma] = columns
    return replace(read, **wider)
