"""Lines affected by the mains: harmonics of 50 and 60 Hz, which repeat as an excitation does."""

from __future__ import annotations

from collections.abc import Sequence

from livebode.core import Lines, meets_mains


def mains_words(lines: Lines, mains_hz: Sequence[float], avoided: Sequence[int]) -> str:
    """Effect of the mains on the lines, for the table of a design; a warning where a line meets a harmonic."""
    left_out = ", ".join(f"{k * lines.resolution_hz:g}" for k in avoided)
    words = f"no line at {left_out} Hz" if avoided else ""
    met = lines.frequency_hz[meets_mains(lines.bins, lines.resolution_hz, mains_hz)]
    if met.size:
        shown = ", ".join(f"{f:g}" for f in met[:6]) + (" …" if met.size > 6 else "")
        return "; ".join(filter(None, (words, f"WARNING: hum adds to the lines at {shown} Hz; move them, or refine")))
    return words or "no line within half a bin of a harmonic"
