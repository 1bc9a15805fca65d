"""Facts in every file about its excitation, so that it can be reproduced."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from livebode.excitation import Waveform
from livebode.version import __version__


def facts(waveform: Waveform) -> dict[str, Any]:
    """Plain data: program, rate, window, lines in bins, peak, and the parameters with the seed."""
    lines = waveform.lines
    return {
        "made_by": f"livebode {__version__} design",
        **waveform.about,
        "rate_hz": lines.rate_hz,
        "window": lines.window,
        "bins": list(lines.bins),
        "unit": "N m",
        "peak": waveform.peak,
        "rms": waveform.rms,
        "crest_factor": waveform.crest_factor,
    }


def as_lines(known: Mapping[str, Any]) -> list[str]:
    """Each fact as a line of text, its value as JSON."""
    return [f"{key}: {json.dumps(value)}" for key, value in known.items()]
