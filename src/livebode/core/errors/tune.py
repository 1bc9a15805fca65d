"""Controllers that cannot be proposed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class TuneError(LivebodeError):
    """No controller can be proposed from the responses, or none meets the specification.

    Examples
    --------
    >>> import livebode
    >>> livebode.TuneError.codes["loop-unchecked"]
    'It was not checked that the described controllers are those of the machine.'
    """

    area: ClassVar[str] = "tune"
    codes: ClassVar[Mapping[str, str]] = {
        "coherence-low": "Too few lines have the coherence that a proposal needs.",
        "controller-unsupported": "The described feedback is not a cascade whose gains can be tuned.",
        "lines-missing": "The lines do not cover the crossover or a resonance.",
        "loop-contradicted": "The recording contradicts the described controllers.",
        "loop-unchecked": "It was not checked that the described controllers are those of the machine.",
        "no-controller": "No controller is described between the two signals of an entry.",
        "no-mode": "The run has no valid fit of the mode that is to be shaped.",
        "no-stable-start": "No controller of the described structure is stable for every plant within the bounds.",
        "shaper-impossible": "No input shaper of a reasonable duration leaves so little vibration.",
        "specification-unmet": "No controller of the described structure meets the specification.",
    }
