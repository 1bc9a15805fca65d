"""Scales of a Bode plot on axes of Matplotlib: logarithmic frequency with plain numbers, quarter turns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.ticker import FuncFormatter, Locator, NullFormatter

from livebode.pictures import ticks

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis


def free_frequency_axis(axes: Axes) -> None:
    """Logarithmic frequency with round numbers wherever its limits are: for axes that others draw on and zoom."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(_FrequencyLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda f, _: ticks.frequency_label(f)))
    axes.xaxis.set_minor_locator(_FrequencyLocator(minor=True))
    axes.xaxis.set_minor_formatter(NullFormatter())


def phase_axis(axis: Axis) -> None:
    """Degrees in steps that divide a quarter turn, wherever the limits are."""
    axis.set_major_locator(_PhaseLocator())


class _FrequencyLocator(Locator):
    """Round frequencies within the limits of the view; minor ones as on logarithmic paper."""

    def __init__(self, minor: bool = False) -> None:
        self._minor = minor

    def __call__(self) -> list[float]:
        assert self.axis is not None
        low_hz, high_hz = sorted(self.axis.get_view_interval())
        return self.tick_values(low_hz, high_hz)

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        if not 0 < vmin < vmax:
            return []
        return ticks.minor_frequency_ticks(vmin, vmax) if self._minor else ticks.frequency_ticks(vmin, vmax)


class _PhaseLocator(Locator):
    """Steps of `ticks.phase_ticks` within the limits of the view."""

    def __call__(self) -> list[float]:
        assert self.axis is not None
        low_deg, high_deg = sorted(self.axis.get_view_interval())
        return self.tick_values(low_deg, high_deg)

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        return ticks.phase_ticks(vmin, vmax) if vmin < vmax else [vmin]
