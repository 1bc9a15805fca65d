"""The kind of estimate of this wing, with its rules."""

from collections.abc import Mapping

ESTIMATES: Mapping[str, Mapping[str, str]] = {
    "output_only": {
        "estimate": "livebode_modes.estimate:OutputOnly",
        "recording": "livebode_modes.recording:examined_outputs",
        "draw": "livebode_modes.terminal:draw_modes",
        "show": "livebode_modes.terminal:show_modes",
    }
}
