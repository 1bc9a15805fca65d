"""The lower row of the picture of a proposed controller: noise of the input, gains over the position, feedforward."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from livebode.core import Model
from livebode.language import number, tr
from livebode.pictures import Style, plain
from livebode_control.margins.loop_picture import round_numbers
from livebode_control.strokes.friction_picture import labelled, speed_unit
from livebode_control.tuning import ControllerProposal
from livebode_control.tuning.feedforward import Feedforward
from livebode_control.tuning.gain_schedule import GainSchedule

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DOTS, _POINTS = 3000, 100


def extra_panels(
    found: ControllerProposal, gains: GainSchedule | None, forward: Feedforward | None
) -> list[Callable[[Axes, Style], None]]:
    """What draws each panel that was asked for."""
    asked: list[Callable[[Axes, Style], None]] = []
    if found.specification.encoder_step is not None or found.specification.noise_limit is not None:
        asked.append(partial(_noise, found))
    if gains is not None:
        asked += [partial(_gains, gains), partial(_bandwidths, gains)]
    if forward is not None and forward.curve is not None:
        asked.append(partial(_friction, forward))
    return asked


def _noise(found: ControllerProposal, axes: Axes, look: Style) -> None:
    """Rms of the plant input due to the noise up to each frequency, before and after; dotted: the limit."""
    from livebode.pictures import frequency_axis

    before = found.loop.feedback
    curves: list[tuple[Model, str, tuple[int, ...]]] = [(found.feedback.model, look.run, (1, 0))]
    if found.before is not None and before is not None:
        curves.append((before, look.muted, (4, 2)))
    f = found.plant.frequency_hz
    shown = f >= found.plant.lines_hz[0]
    for feedback, colour, dashes in curves:
        axes.plot(f[shown], found.noise_up_to(feedback)[shown], color=colour, linewidth=1.5, dashes=dashes)
    if (limit := found.specification.noise_limit) is not None:
        axes.axhline(limit, color=look.ink, linewidth=1.2, linestyle=":")
    encoder = found.specification.encoder_step is not None
    title = tr("input noise by the encoder's rounding") if encoder else tr("input noise for white noise of 1")
    axes.set_title(title, fontsize=10)
    axes.set_ylabel(tr("rms up to this frequency"))
    axes.set_xlabel(tr("frequency in Hz"))
    axes.set_ylim(bottom=0)
    plain(axes)
    frequency_axis(axes, np.delete(round_numbers(f[shown][0], f[-1]), -2), labels=True)


def _gains(gains: GainSchedule, axes: Axes, look: Style) -> None:
    """Gains and times of each place over those of one controller for all places."""
    for i, (name, column) in enumerate(zip(gains.names, (gains.logarithms - gains.common_logarithms).T)):
        dashes = ((1, 0), (4, 2), (1, 1), (4, 1, 1, 1))[i % 4]
        colour = look.run if i == 0 else look.ink
        axes.plot(gains.position, np.exp(column), color=colour, linewidth=1.5, marker="o", markersize=4, dashes=dashes,
                  label=name.replace("_", " "))  # fmt: skip
    axes.axhline(1, color=look.muted, linewidth=0.9)
    axes.set_title(tr("gains over those of one controller"), fontsize=10)
    axes.set_xlabel(tr("position"))
    axes.legend(fontsize=9)
    plain(axes)


def _bandwidths(gains: GainSchedule, axes: Axes, look: Style) -> None:
    """Promised bandwidth of each place; dashed: with one controller for all places."""
    highest_hz = 0.0
    for promised, colour, dashes in (
        (gains.common_promised, look.muted, (4, 2)), (gains.promised, look.run, (1, 0)),
    ):  # fmt: skip
        hz = [one.bandwidth_hz for one in promised]
        axes.plot(gains.position, hz, color=colour, linewidth=1.5, marker="o", markersize=4, dashes=dashes)
        highest_hz = max(highest_hz, *hz)
    axes.set_title(tr("promised bandwidth; dashed: one controller"), fontsize=10)
    axes.set_xlabel(tr("position"))
    axes.set_ylabel(tr("bandwidth in Hz"))
    axes.set_ylim(0, 1.1 * highest_hz)
    plain(axes)


def _friction(forward: Feedforward, axes: Axes, look: Style) -> None:
    """Measured friction over speed, and that of the feedforward with its band."""
    curve = forward.curve
    assert curve is not None
    speed, friction = curve.measured[:, :: max(curve.measured.shape[1] // _DOTS, 1)]
    axes.plot(speed, friction, ".", color=look.muted, alpha=0.35, markersize=3)
    for sign in (-1, 1):
        v = sign * np.linspace(0, curve.speed[1], _POINTS)
        value, bound = forward.friction(v, sign)
        axes.fill_between(v, value - bound, value + bound, color=look.run, alpha=0.25, linewidth=0)
        axes.plot(v, value, color=look.run, linewidth=1.5)
    words = {"inertia": number(forward.inertia, ".4g"), "bound": number(forward.inertia_bound, ".2g")}
    axes.set_title(tr("feedforward: inertia {inertia} ± {bound}, friction", **words), fontsize=10)
    axes.set_xlabel(labelled(tr("speed"), speed_unit(curve)))
    axes.set_ylabel(labelled(tr("friction"), curve.units[curve.index("coulomb")]))
    plain(axes)
