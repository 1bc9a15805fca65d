"""Recordings that cannot be read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class RecordingError(LivebodeError):
    """A file with recorded samples cannot be read, or is not what was asked for.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.open_log("missing.csv")
    ... except livebode.RecordingError as error:
    ...     print(error.code)
    recording.not-found
    """

    area: ClassVar[str] = "recording"
    codes: ClassVar[Mapping[str, str]] = {
        "cell-not-a-number": "A cell of a table is not a number.",
        "channel-ambiguous": "The name belongs to more than one channel of the file.",
        "channel-duplicated": "Two columns of the file have the same name.",
        "channel-missing": "The file has no channel with samples.",
        "channel-unknown": "The file has no channel of this name.",
        "clocks-apart": "Channels that are read together were recorded at different times.",
        "clocks-differ": "Channels that are read together are sampled by different clocks.",
        "damaged": "The content of the file contradicts its format.",
        "dbc-missing": "The file contains CAN frames, and no DBC file defines their signals.",
        "declaration-refused": "The XML declares a document type or entities, which are never read.",
        "empty": "The file has no samples.",
        "format-unknown": "The content of the file is not of a supported format.",
        "incomplete": "The measurement lacks a part that is needed.",
        "lengths-differ": "Channels that are read together have different numbers of samples.",
        "line-ragged": "A line of a table has another number of cells than the others.",
        "line-too-long": "A line of a table is longer than any line of a recording.",
        "no-frames": "A DBC file is given for a file without CAN frames.",
        "not-a-file": "The path is a directory, a pipe or a device.",
        "not-an-excitation": "The file is not an excitation that `livebode design` wrote.",
        "not-found": "There is no such file.",
        "not-readable": "The operating system refuses to read the file.",
        "rate-conflict": "The given sampling rate contradicts the file.",
        "rate-implausible": "The time column gives a sampling rate that no recording has.",
        "rate-missing": "Neither the file nor the call gives the sampling rate.",
        "recording-repeated": "Two recordings of one run have the same content.",
        "recordings-differ": "Recordings of one run differ in their rate, units, window or lines.",
        "spectrum": "The file is a table over the frequency, not over the time.",
        "table-missing": "The file is text without rows of numbers.",
        "time-irregular": "The time column is not regular apart from whole missing samples, or has too many gaps.",
        "time-jitter": "The time column jitters too much for a spectrum.",
        "time-not-finite": "The time column has an empty cell, NaN or infinity.",
        "time-not-increasing": "The time column decreases or repeats.",
        "time-unit": "The unit of the time column is missing or is not a unit of time.",
        "too-large": "The file has more columns, parts or bytes than are read.",
        "truncated": "The file ends before its content does.",
    }
