"""Lines of the time with a constant amplitude, separated from orders by one fit of both."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import f_exceeded
from livebode.motion import Shaft, Stroke

_SEPARATE = 0.5  # share of a line's power that no order explains
_RIDGE = 1e-9  # of the scaled normal matrix: lines that are orders in every stroke make it singular
_BESIDE = np.array([*range(-8, -2), *range(3, 9)])  # bins of a stroke: noise beside a line, outside the main lobe
_FALSE = 1e-3  # probability that a constant line is taken for one that varies


def without_lines(strokes: Sequence[Stroke], shafts: Sequence[Shaft], lines_hz: Floats) -> tuple[list[Stroke], Floats]:
    """The strokes without the lines that can be separated from the orders, and the other lines.

    An order has one phase over the angle in all strokes, and a line one phase over the time. So least squares of both
    over all strokes tell them apart even where their frequencies meet in some of them, if the line has another phase
    against the order, or meets it not at all, in others. A line remains if orders explain more than half of its power,
    or if its amplitude or phase differs between the strokes: what the fit leaves at its frequency is then above the
    noise beside it. A line that is constant remains with a probability of 0.1 %.

    Parameters
    ----------
    strokes
        Any number of signals; the first one decides whether a line is constant.
    shafts
        Shafts with their orders.
    lines_hz
        Exact frequencies of lines, in the time of the samples.
    """
    if not lines_hz.size or not strokes:
        return list(strokes), lines_hz
    columns = 2 * (lines_hz.size + sum(len(shaft.orders) for shaft in shafts))
    normal, moment = np.zeros((columns, columns)), np.zeros((columns, len(strokes[0].torque)))
    for stroke in strokes:
        tapered = _columns(stroke, shafts, lines_hz) * _taper(stroke)[:, np.newaxis]
        normal += tapered.T @ tapered
        moment += tapered.T @ (stroke.torque * _taper(stroke)).T
    scale = np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal / np.outer(scale, scale) + _RIDGE * np.eye(columns))
    value = inverse @ (moment / scale[:, np.newaxis]) / scale[:, np.newaxis]
    alone = (1 / np.diag(inverse))[: 2 * lines_hz.size].reshape(2, -1).min(axis=0)
    subtract = (alone >= _SEPARATE) & _constant(strokes, shafts, lines_hz, value[:, 0])
    take = np.concatenate([np.tile(subtract, 2), np.zeros(columns - 2 * lines_hz.size, dtype=bool)])
    quiet = [
        replace(stroke, torque=stroke.torque - (_columns(stroke, (), lines_hz[subtract]) @ value[take]).T)
        for stroke in strokes
    ]
    return quiet, lines_hz[~subtract]


def _columns(stroke: Stroke, shafts: Sequence[Shaft], lines_hz: Floats) -> Floats:
    """Cosines and sines of the lines, then those of the orders of each shaft, (samples, columns)."""
    return np.concatenate(list(_blocks(stroke, shafts, lines_hz)), axis=1)


def _blocks(stroke: Stroke, shafts: Sequence[Shaft], lines_hz: Floats) -> Iterator[Floats]:
    phases = [2 * np.pi * np.multiply.outer(_time_s(stroke), lines_hz)]
    phases += [np.multiply.outer(stroke.angle * shaft.turns, np.array(shaft.orders)) for shaft in shafts]
    for phase in phases:
        yield np.cos(phase)
        yield np.sin(phase)


def _constant(strokes: Sequence[Stroke], shafts: Sequence[Shaft], lines_hz: Floats, value: Floats) -> NDArray[np.bool_]:
    """Whether the fit leaves no more at each line than the noise beside it.

    Long strokes decide. So the degrees of freedom of the sum are those of Satterthwaite.
    """
    on_line, beside = np.zeros((2, len(strokes), lines_hz.size))
    for number, stroke in enumerate(strokes):
        residual = (stroke.torque[0] - _columns(stroke, shafts, lines_hz) @ value) * _taper(stroke) ** 2
        time_s = _time_s(stroke)
        bins = np.array([0, *_BESIDE]) * stroke.rate_hz / residual.size
        for i, line in enumerate(lines_hz):
            power = np.abs(np.exp(-2j * np.pi * np.multiply.outer(line + bins, time_s)) @ residual) ** 2
            on_line[number, i], beside[number, i] = power[0], power[1:].mean()
    noise = np.maximum(beside.sum(axis=0), np.finfo(float).tiny)
    ratio = on_line.sum(axis=0) / noise
    dof = [2 * max(int(count), 1) for count in noise**2 / np.maximum((beside**2).sum(axis=0), np.finfo(float).tiny)]
    return np.array(
        [
            f_exceeded(float(quotient), many, many * _BESIDE.size) > _FALSE
            for quotient, many in zip(ratio, dof, strict=True)
        ]
    )


def _time_s(stroke: Stroke) -> Floats:
    return np.asarray((stroke.first + np.arange(stroke.angle.size)) / stroke.rate_hz)


def _taper(stroke: Stroke) -> Floats:
    """Hann, so that what the friction leaves at the ends of a stroke does not leak into the lines."""
    return np.hanning(stroke.angle.size + 2)[1:-1]
