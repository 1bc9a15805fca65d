"""Live sources that cannot be used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class SourceError(LivebodeError):
    """A live source cannot be opened, or sends what cannot be used.

    Examples
    --------
    >>> import livebode
    >>> livebode.SourceError.codes["no-samples"]
    'No samples came in time.'
    """

    area: ClassVar[str] = "source"
    codes: ClassVar[Mapping[str, str]] = {
        "batch-shape": "A batch of samples or spectra has another shape than its channels need, or too many values.",
        "cannot-grow": "The file to follow is of a format that cannot grow.",
        "channel-unknown": "The live source has no channel of this name.",
        "channels-invalid": "The sender's channels are too many, or their names are missing, duplicated or unusable.",
        "frame-damaged": "Bytes are not a frame, or the frame was damaged on its way.",
        "frame-inconsistent": "A frame contradicts its own header or its layout.",
        "frame-too-long": "The samples are too many for one frame.",
        "frame-unsupported": "The version, kind or flags of a frame are not supported.",
        "key-missing": "A required key or field is missing in a message of the sender.",
        "key-unknown": "A message of the sender has an unknown key.",
        "layout-invalid": "The text that describes the channels or spectra cannot be read.",
        "line-not-json": "A line of the sender is not a JSON object.",
        "line-not-numbers": "A line of the sender does not have a number for each channel.",
        "line-too-long": "A line of the sender is longer than is read.",
        "no-samples": "No samples came in time.",
        "not-found": "The file to follow does not exist yet.",
        "refused": "The machine refuses the connection, or does not give what was asked for; it is not tried again.",
        "ring-invalid": "The symbol in the PLC is not a ring buffer, or its header contradicts its size.",
        "spectrum-misplaced": "A spectrum ends at a sample that does not fit the hop.",
        "value-invalid": "A value in a message of the sender is not of its type, or out of range.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset({"no-samples", "not-found"})
