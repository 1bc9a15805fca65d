"""Margins of one fit, with bounds that contain every model that its lines do not tell apart."""

from __future__ import annotations

from dataclasses import replace
from math import erf

import numpy as np

from livebode.analysis._margins import Margins
from livebode.analysis.margin_reading import margins
from livebode.analysis.open_loop import OpenLoop
from livebode.arrays import Floats
from livebode.core import COVERAGE, Loop, half_width
from livebode.fitting import Fit

_FACTOR = float(half_width(np.ones(1), COVERAGE)[0])
_HALVINGS = 40  # of an interval, to 1e-12 of it
_erf = np.vectorize(erf, otypes=[float])


def margins_of(fit: Fit, loop: Loop) -> Margins:
    """Margins of a fit, one row, by `Fit.with_unseen` and by each of its competitors.

    The bound contains 95 % of the competitors' distributions, by their weights, and the square of sigma is at least the
    mean of the square of a competitor's own sigma and of the distance of its margin: beyond the lines, competitors that
    fit alike differ. The loop was measured while it was closed, so one that would make it unstable is not one of them.
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
        known = each.ok[:, np.newaxis] & np.isfinite(at) & np.isfinite(own) & np.isfinite(middle)
        share = np.where(known, weight[:, np.newaxis], 0.0)
        total = share.sum(axis=0)
        share = share / np.where(total > 0, total, 1.0)
        with np.errstate(invalid="ignore"):
            apart = np.where(known, np.abs(at - middle), 0.0)
        own = np.where(known, own, 0.0)
        spread = np.maximum(np.sqrt(np.sum(share * (own**2 + apart**2), axis=0)), _covering(share, apart, own))
        columns[-1] = np.where(total > 0, spread, columns[-1])
        wider[sigma] = columns
    return replace(read, **wider)


def _covering(share: Floats, apart: Floats, own: Floats) -> Floats:
    """Sigma whose 95 % bound contains 95 % of normal distributions (rows, quantities) with these shares, distances and
    sigmas."""
    low, high = np.zeros(share.shape[1]), np.max(apart + 2 * _FACTOR * own, axis=0)
    size = np.sqrt(2) * np.maximum(own, 1e-12 * high + 1e-300)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        inside = (_erf((middle - apart) / size) + _erf((middle + apart) / size)) / 2
        enough = np.sum(share * inside, axis=0) >= COVERAGE
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.asarray(high / _FACTOR)
