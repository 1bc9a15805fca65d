"""Modes from the outputs alone: frequencies and dampings of what rings, without an input."""

from typing import TYPE_CHECKING

from livebode.on_first_use import on_first_use

if TYPE_CHECKING:
    from livebode.output_only.band import proposed_band
    from livebode.output_only.curves import ModeCurve
    from livebode.output_only.mode_tracker import ModeTracker, WindowModes
    from livebode.output_only.reduction import lost_samples
    from livebode.output_only.settings import OUTPUTS_MAX, OutputOnlySettings, reduced, window_of
    from livebode.output_only.stabilisation import Mode
    from livebode.output_only.tracks import Tracks

_NAMES = {
    "band": ("proposed_band",),
    "curves": ("ModeCurve",),
    "mode_tracker": (
        "ModeTracker",
        "WindowModes",
    ),
    "reduction": ("lost_samples",),
    "settings": (
        "OUTPUTS_MAX",
        "OutputOnlySettings",
        "reduced",
        "window_of",
    ),
    "stabilisation": ("Mode",),
    "tracks": ("Tracks",),
}
__getattr__ = on_first_use(__name__, _NAMES)

__all__ = [
    "OUTPUTS_MAX",
    "Mode",
    "ModeCurve",
    "ModeTracker",
    "OutputOnlySettings",
    "Tracks",
    "WindowModes",
    "lost_samples",
    "proposed_band",
    "reduced",
    "window_of",
]
