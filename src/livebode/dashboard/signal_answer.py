"""Answer to a page that asks for raw signals or their spectrum.

A u32 with the length of a JSON object, the object, spaces up to a multiple of 4 bytes, then for each channel its arrays
of `points` values: over time u32 sample numbers from the first one and f32 values; of a spectrum f32 frequencies in Hz,
f32 largest and f32 smallest amplitudes of a column of the plot. Numbers are little endian; unknown values are NaN.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, Lines
from livebode.dashboard.signal_points import columns_of, extremes, remark_of
from livebode.dashboard.signal_spectrum import amplitude_spectrum
from livebode.records import to_json

Picture = Literal["time", "linear", "log"]
"""Over time, or a spectrum over a linear or logarithmic frequency axis."""
WhyNot = Literal["collecting", "spectra", "unrecorded", "outside"]
"""No sample has arrived yet; the source sends spectra; samples are not recorded; not those of the requested time."""
_Parts = list[NDArray[Any]]


def why_not(reason: WhyNot) -> bytes:
    """The answer without signals."""
    return _packed({"why_not": reason}, [])


def answer(block: Block, lines: Lines, picture: Picture) -> bytes:
    """The answer with all channels of these samples."""
    made = [_channel(channel, x, lines, picture) for channel, x in zip(block.channels, block.data)]
    head = {
        "why_not": "",
        "rate_hz": block.rate_hz,
        "from_s": block.origin_s + block.start / block.rate_hz,
        "to_s": block.origin_s + block.stop / block.rate_hz,
        "samples": len(block),
        "lines_hz": lines.frequency_hz.tolist(),
        "detection_hz": (np.array(lines.quiet) * lines.resolution_hz).tolist(),
        "channels": [about for about, _ in made],
    }
    return _packed(head, (array for _, arrays in made for array in arrays))


def _channel(channel: Channel, x: NDArray[np.float64], lines: Lines, picture: Picture) -> tuple[dict[str, Any], _Parts]:
    about: dict[str, Any] = {"name": channel.name, "unit": channel.unit, **asdict(remark_of(x))}
    if picture == "time":
        at = extremes(x)
        return about | {"points": len(at)}, [at.astype("<u4"), x[at].astype("<f4")]
    found = amplitude_spectrum(x, lines.rate_hz, lines.window)
    if found is None:
        return about | {"points": 0, "seconds": 0.0, "resolution_hz": None}, []
    at, low = columns_of(found.amplitude, logarithmic=picture == "log")
    about |= {
        "points": len(at),
        "seconds": found.samples / found.rate_hz,
        "resolution_hz": found.resolution_hz,
        "lines": found.at(np.array(lines.bins), lines.window).tolist(),
        "detection": found.at(np.array(lines.quiet, dtype=np.int64), lines.window).tolist(),
    }
    return about, [v.astype("<f4") for v in (found.frequency_hz[at], found.amplitude[at], low)]


def _packed(head: dict[str, Any], arrays: Iterable[NDArray[Any]]) -> bytes:
    text = to_json(head).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([struct.pack("<I", len(text)), text, *(array.tobytes() for array in arrays)])
