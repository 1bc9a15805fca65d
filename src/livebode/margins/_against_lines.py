"""Margins of a fit compared with the sensitivity at the lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.core import Loop, Responses
from livebode.margins._margins import CONTRADICTED, NAMES, NONE, Margins

_CHANCE = 0.01  # of all lines of a row together


def against_lines(found: Margins, responses: Responses, loop: Loop) -> Margins:
    """The same margins, without numbers where the lines show a larger Ms than the fit allows.

    A row is contradicted where |S| = 1/|1 + F·G| at a line, less its bound, is above Ms plus its bound: the model omits
    what brings the loop nearer to −1, so all its margins are invalid. The lines' bound covers all lines of a row
    together with 99 %, by Bonferroni: 1 − exp(−c²) = 1 − 0.01/lines.

    Parameters
    ----------
    found
        Margins, a row for each fit.
    responses
        The fitted responses, shapes (rows, lines).
    loop
        The loop with its feedback.

    Returns
    -------
    With the status "contradicted by the lines" and NaN in such rows.
    """
    if not len(found):
        return found
    behind = loop.feedback_at(responses.lines.frequency_hz)
    c = float(np.sqrt(np.log(len(responses.lines) / _CHANCE)))
    with np.errstate(invalid="ignore", divide="ignore"):  # of invalid lines
        sensitivity = 1 / (1 + responses.value * behind)
        least = np.abs(sensitivity) - responses.bound(c) * np.abs(behind * sensitivity**2)
        shown = np.where(responses.valid & np.isfinite(least), least, -np.inf).max(axis=1)
        most = (found.value + found.bound())[:, NAMES.index("peak_sensitivity")]
        wrong = found.ok & (shown > most)
    if not wrong.any():
        return found
    status = found.status.astype(f"<U{max(len(CONTRADICTED), found.status.dtype.itemsize // 4)}")
    status[wrong] = CONTRADICTED
    numbers = ("value", "sigma", "frequency_hz", "frequency_sigma_hz")
    kept = {name: np.where(wrong[:, np.newaxis], np.nan, getattr(found, name)) for name in numbers}
    return replace(found, **kept, status=status, place=np.where(wrong[:, np.newaxis], NONE, found.place))
