"""The picture of a validation: measured and simulated output, and the residual's correlations with their limits."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from livebode.language import tr, worded
from livebode.pictures import (
    ABOVE,
    BELOW,
    LIGHT,
    TITLE,
    Band,
    Bars,
    DotKind,
    Dots,
    Entry,
    Figure,
    Mark,
    Panel,
    Trace,
    room,
    save_svg,
    scale_around,
    unlabelled,
    value_scale,
)

if TYPE_CHECKING:
    from livebode_control.validation.correlation import Correlation
    from livebode_control.validation.validation import Validation

_SHOWN = 600  # samples of the output
_CLIPPED = 4.0  # times the limit: larger correlations are clipped at the edge, with a mark
_HEIGHT, _LOW = 120.0, 76.0


def save_validation_picture(
    validations: Sequence[Validation], directory: str | PathLike[str], *, title: str = ""
) -> Path:
    """Write validation.svg to an existing directory."""
    return save_svg(validation_figure(validations, title=title), Path(directory) / "validation.svg")


def validation_figure(validations: Sequence[Validation], *, title: str = "") -> Figure:
    """The last samples of the output for each model, and below them the correlations over the lags.

    The band contains 97 % of random correlations at a lag; the dashed lines are ±2.17/√L. Lags that cannot detect a
    wrong model are thin; a triangle at the edge marks a correlation beyond it.
    """
    panels: list[Panel] = []
    top = 0.0
    for validation in validations:
        top += TITLE + ABOVE
        panels.append(_output(validation, top))
        top += _HEIGHT + BELOW
        for number, c in enumerate(validation.correlations, 1):
            top += TITLE + ABOVE
            panels.append(_correlation(c, c.name in validation.judged_by, top, number == len(validation.correlations)))
            top += _LOW
        top += BELOW
    facts = (
        tr("{samples} samples", samples=validations[0].samples), tr("band: 97 % of random correlations at each lag"),
        tr("dashed: {limit:.2f}/√L", limit=2.17),
    )  # fmt: skip
    key = Entry(tr("measured"), LIGHT.newest), Entry(tr("ŷ, simulated"), LIGHT.run)
    return Figure(title or tr("Validation"), facts, key, panels, top)


def _output(validation: Validation, top: float) -> Panel:
    shown = slice(max(0, validation.samples - _SHOWN), validation.samples)
    at_s = np.arange(validation.samples)[shown] / validation.rate_hz
    measured, simulated = validation.measured[shown], validation.simulated.output[shown]
    title = tr(
        "{model}: {verdict}, fit {percent:.1f} %",
        model=worded(validation.model), verdict=worded(validation.verdict), percent=validation.fit_percent,
    )  # fmt: skip
    y = scale_around([measured, simulated], validation.output, 4)
    marks = (
        Trace("measured", at_s, measured, LIGHT.newest, 2.6), Trace("simulated", at_s, simulated, LIGHT.run, 0.9),
    )  # fmt: skip
    left = room(y)
    x = value_scale(float(at_s[0]), float(at_s[-1]), tr("time in s"))
    return Panel(left, top, 588.0 - left, _HEIGHT, x, y, marks, title=title)


def _reach(c: Correlation) -> float:
    limit = float(np.max(c.limit))
    return 1.15 * min(max(limit, float(np.max(np.abs(c.value)))), _CLIPPED * max(limit, c.white_limit))


def _correlation(c: Correlation, counts: bool, top: float, last: bool) -> Panel:
    reach = _reach(c)
    beyond = np.abs(c.value) > reach
    outside = c.judged & (np.abs(c.value) > c.limit) & ~beyond
    lags, zero = np.asarray(c.lags, dtype=float), np.zeros(len(c.lags))
    ends = lags[[0, -1]]
    marks: list[Mark] = [Band("limit", lags, zero - c.limit, zero + c.limit, LIGHT.run, 0.2)]
    marks += [Trace("white", ends, np.full(2, sign * c.white_limit), LIGHT.muted, 0.9, "dashed") for sign in (-1, 1)]
    for of, colour, thick in ((c.judged, LIGHT.run, 1.6), (~c.judged, LIGHT.muted, 0.6)):
        marks.append(Bars("correlation", lags[of], zero[of], c.value[of], colour, thick))
    marks.append(Dots("outside", lags[outside], c.value[outside], LIGHT.newest, 4.0))
    signs: tuple[tuple[int, DotKind], ...] = ((1, "up"), (-1, "down"))
    for sign, kind in signs:
        far = lags[beyond & (np.sign(c.value) == sign)]
        marks.append(Dots("beyond", far, np.full(len(far), 0.94 * sign * reach), LIGHT.newest, 5.0, kind))
    share = tr("{percent:.0f} % inside", percent=100 * c.share) if counts else tr("does not count")
    title = tr("ε with {signal}: {share}", signal=c.name, share=share)
    x = value_scale(float(ends[0]), float(ends[1]), tr("lag in samples"))
    y = value_scale(-reach, reach, tr("correlation"), 5)
    left = room(y)
    return Panel(left, top, 588.0 - left, _LOW, x if last else unlabelled(x), y, marks, title=title)
