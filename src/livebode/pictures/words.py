"""Texts of the pictures: the quantity, its unit, how much is valid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from livebode.core import Response, Responses, moment, moment_of_start
from livebode.language import Message, numerals, quantity_name, tr, trn, worded
from livebode.pictures._style import shortened
from livebode.pictures.ticks import frequency_label

if TYPE_CHECKING:
    from livebode.core import MatrixResponses

_SYMBOL: dict[str, str] = {
    Message("plant"): "G",
    Message("open loop"): "L",
    Message("closed loop"): "T",
    Message("sensitivity"): "S",
}
_READABLE_TO_S = 1e5  # ticks with more digits than this, over a short span, differ only in the last ones


def quantity(responses: Response | Responses) -> str:
    """The quantity with its usual letter: "plant G"."""
    letter = _SYMBOL.get(responses.quantity)
    name = worded(str(responses.quantity))
    return f"{name} {letter}" if letter else name


def magnitude_label(responses: Responses, letters: int = 60) -> str:
    """The label of the magnitude, with the unit of 0 dB."""
    return shortened(decibel_label(responses.unit), letters)


def decibel_label(unit: str) -> str:
    """Magnitude in dB, with the unit of 0 dB if there is one."""
    return tr("magnitude in dB re 1 {unit}", unit=unit) if unit else tr("magnitude in dB")


def lines_phrase(responses: Responses | MatrixResponses) -> str:
    """Number of lines and their range."""
    f = responses.lines.frequency_hz
    if len(f) == 1:
        return tr("1 line, {at} Hz", at=numerals(frequency_label(f[0])))
    low, high = (numerals(frequency_label(f_hz)) for f_hz in (f[0], f[-1]))
    return tr("{count} lines, {low}–{high} Hz", count=len(f), low=low, high=high)


def facts(responses: Responses, valid_rows: int, names: tuple[str, str] | None = None) -> list[str]:
    """What is below the title: quantity and channels, lines, and how much is valid."""
    description = quantity(responses)
    if names:
        first, second = (shortened(name, 30) for name in names)
        description = tr("{quantity} from {input} to {output}", quantity=description, input=first, output=second)
    valid = trn("{valid} of {n} response valid", "{valid} of {n} responses valid", len(responses), valid=valid_rows)
    return [description, lines_phrase(responses), valid]


def labelled(name: str, unit: str) -> str:
    """A quantity with its unit."""
    text = quantity_name(name)
    return tr("{name} in {unit}", name=text, unit=worded(unit)) if unit else text


def clock(time_s: np.ndarray) -> tuple[float, str]:
    """Origin to subtract from times, with the label: seconds since 1970 are unreadable as ticks."""
    finite = time_s[np.isfinite(time_s)]
    first, last = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    if abs(first) < _READABLE_TO_S or last - first > abs(first) / 10:
        start = moment_of_start()
        return 0.0, tr("time in s after {start}", start=start) if start else tr("time in s")
    origin = float(np.floor(first))
    return origin, tr("time in s after {start}", start=moment(origin, 0))
