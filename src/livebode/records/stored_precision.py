"""Responses as a lake or a fleet stores them, without storing them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebode.core import Responses

_STORED = {"complex128": np.complex64, "float64": np.float32}
_ROUNDED = ("value", "weight", "sigma", "coherence", "input_coherence", "distortion", "variation", "schedule", "dof")


def in_stored_precision(responses: Responses) -> Responses:
    """The responses as `from_wide(to_wide(responses))` gives them: all but times is rounded to float32."""
    values = {name: getattr(responses, name) for name in _ROUNDED}
    with np.errstate(over="ignore", under="ignore"):
        rounded = {name: each.astype(_STORED[each.dtype.name]).astype(each.dtype) for name, each in values.items()}
    return replace(responses, **rounded)
