"""NextSpectrum: the message with the next spectrum of a stream, recognised by comparison with the one before it."""

from __future__ import annotations

import zlib
from typing import Any, NamedTuple

from livebode.core import SpectraLayout
from livebode.sources.live.batch import SAMPLE_MAX
from livebode.sources.live.framing import CRC, FLOAT64, HEADER, read_header
from livebode.sources.live.spectra_frame import stamp_of

_KIND = slice(0, 5)
"""Magic, version, kind, flags and length."""
_FORM = slice(9, 13)
"""Rate, layout, channels, samples."""
_WHOLE = b"\0\0\0\0"


class FoundSpectrum(NamedTuple):
    """The sender's number of the first sample of a spectrum, and its clock there."""

    first_sample: int
    stamp_s: float | None


class NextSpectrum:
    """Recognises messages that differ from an accepted one only in sequence, sample, stamp and content.

    Nearly all messages of a drive are such. Their layout is known by its bytes, so that reading them takes a few
    comparisons instead of an object for each part.

    Parameters
    ----------
    message
        A message with one spectrum, which was read and accepted without an error.
    layout
        Of its spectrum.

    Attributes
    ----------
    payload
        Where the spectrum is in each message.
    double
        Whether its numbers are float64.
    """

    def __init__(self, message: bytes, layout: SpectraLayout) -> None:
        begin = read_header(message).length
        header = read_header(memoryview(message)[begin:])
        fields = tuple(header)
        self.layout, self.rate_hz, self._epoch = layout, header.rate_hz, header.epoch
        self.double = bool(header.flags & FLOAT64)
        self.payload = slice(begin + HEADER.size, len(message) - CRC.size)
        self._announced, self._begin, self._length = message[:begin], begin, len(message)
        self._kind, self._form = fields[_KIND], fields[_FORM]

    def found(self, message: bytes) -> FoundSpectrum | None:
        """What is in a message with a whole spectrum of this kind; None for any other, also for a damaged one."""
        begin, stop = self._begin, self._length - CRC.size
        if len(message) != self._length or not message.startswith(self._announced):
            return None
        header: tuple[Any, ...] = HEADER.unpack_from(message, begin)
        if header[_KIND] != self._kind or header[_FORM] != self._form or header[6] != self._epoch:
            return None
        if zlib.crc32(memoryview(message)[begin:stop]) != CRC.unpack_from(message, stop)[0]:
            return None
        sample, stamp_ns = header[7:9]
        if sample >= SAMPLE_MAX or not message.startswith(_WHOLE, begin + HEADER.size):
            return None
        stamp_s = stamp_of(stamp_ns, self.layout.hop, self.rate_hz) if stamp_ns else None
        return FoundSpectrum(sample + 1 - self.layout.hop, stamp_s)
