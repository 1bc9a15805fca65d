"""Ticks with the decimal sign of the language in use: Matplotlib knows only that of the process."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from livebode.core import needing
from livebode.language import numerals

with needing("Matplotlib", "plots", "a picture"):
    from matplotlib.ticker import Formatter

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def localise_ticks(figure: Figure) -> None:
    """Let all axes of the figure format their numbers as before, in the language in use."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(_Local(axis.get_major_formatter()))


class _Local(Formatter):
    def __init__(self, usual: Formatter) -> None:
        self._usual = usual

    def set_axis(self, axis: Any) -> None:
        super().set_axis(axis)
        self._usual.set_axis(axis)

    def set_locs(self, locs: list[float]) -> None:
        super().set_locs(locs)
        self._usual.set_locs(locs)

    def __call__(self, x: float, pos: int | None = None) -> str:
        return numerals(self._usual(x, pos))

    def get_offset(self) -> str:
        return numerals(self._usual.get_offset())
