r"""Spectra in frames, and the text of their layout. docs/how-to/live.md describes both byte by byte.

The text is UTF-8, one item per line, its parts separated by tabs: ``window``, ``hop``, ``lines``, ``quiet``, then a
``signal`` for each spectrum and a ``value`` for each plain value, in the order of the payload.
"""

from __future__ import annotations

import zlib
from functools import lru_cache
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, SourceError, SpectraLayout
from livebode.sources.live.batch import check_channels
from livebode.sources.live.framing import FLOAT64, SPECTRA, SPECTRA_LAYOUT, Header, framed, inconsistent_frame
from livebode.sources.live.spectra_batch import SpectraBatch

_STATES = 3
_DIFFERENCED = "differenced"


def spectra_text(layout: SpectraLayout) -> bytes:
    r"""Payload of a layout frame of spectra.

    >>> spectra_text(SpectraLayout((Channel("w", "N m"),), (Channel("x", "m"),), window=400, hop=20, lines=(2, 4)))
    b'window\t400\nhop\t20\nlines\t2 4\nsignal\tw\tN m\t0\nvalue\tx\tm\n'
    """
    rows = [f"window\t{layout.window}", f"hop\t{layout.hop}", "lines\t" + " ".join(map(str, layout.lines))]
    if layout.quiet:
        rows.append("quiet\t" + " ".join(map(str, layout.quiet)))
    for signal, constant, differenced in zip(layout.signals, layout.subtracted, layout.differenced):
        rows.append(f"signal\t{signal.name}\t{signal.unit}\t{constant:.17g}" + f"\t{_DIFFERENCED}" * differenced)
    rows += [f"value\t{value.name}\t{value.unit}" for value in layout.values]
    return "".join(f"{row}\n" for row in rows).encode("utf-8")


def read_spectra_text(text: bytes) -> SpectraLayout:
    """The layout in such a text; SourceError if it is not one."""
    found: dict[str, list[list[str]]] = {word: [] for word in ("window", "hop", "lines", "quiet", "signal", "value")}
    try:
        rows = text.decode("utf-8").removesuffix("\n").split("\n")
    except UnicodeDecodeError:
        raise _wrong("a layout is not UTF-8") from None
    for row in rows:
        word, *parts = row.split("\t")
        if word not in found:
            raise _wrong(
                f"a layout of spectra has {word[:40]!r}, which is not one of {', '.join(found)}", word=word[:40]
            )
        found[word].append(parts)
    for word in ("window", "hop", "lines", "quiet"):
        if [len(parts) for parts in found[word]] not in ([1], [] if word == "quiet" else [1]):
            raise _wrong(f"a layout of spectra needs one line {word!r} with one part after it", word=word)
    signals = [_signal(parts) for parts in found["signal"]]
    values = [_channel("value", parts, 2) for parts in found["value"]]
    check_channels(tuple(signal for signal, _, _ in signals))
    check_channels(tuple(values), at_least=0)
    return SpectraLayout(
        signals=tuple(signal for signal, _, _ in signals),
        values=tuple(values),
        window=_numbers("window", found)[0],
        hop=_numbers("hop", found)[0],
        lines=_numbers("lines", found),
        quiet=_numbers("quiet", found) if found["quiet"] else (),
        subtracted=tuple(constant for _, constant, _ in signals),
        differenced=tuple(differenced for _, _, differenced in signals),
    )


def _wrong(message: str, **facts: object) -> SourceError:
    return SourceError("layout-invalid", message, "correct the sender", **facts)


def _numbers(word: str, found: dict[str, list[list[str]]]) -> tuple[int, ...]:
    text = found[word][0][0]
    numbers = text.split(" ")
    if not all(number.isascii() and number.isdigit() and len(number) < 9 for number in numbers):
        raise _wrong(f"a layout of spectra has {word} {text[:40]!r}, which are not whole numbers", word=word)
    return tuple(map(int, numbers))


def _channel(word: str, parts: list[str], most: int) -> Channel:
    if not 1 <= len(parts) <= most:
        raise _wrong(f"a layout of spectra has a {word} with {len(parts)} parts, not 1 to {most}", word=word)
    return Channel(parts[0], "".join(parts[1:2]))


def _signal(parts: list[str]) -> tuple[Channel, float, bool]:
    channel = _channel("signal", parts, 4)
    try:
        constant = float(parts[2]) if len(parts) > 2 else 0.0
    except ValueError:
        constant = float("nan")
    if not isfinite(constant):
        raise _wrong(
            f"signal {channel.name[:40]!r} has the constant {parts[2][:40]!r}, which is not a number", word="signal"
        )
    if len(parts) > 3 and parts[3] != _DIFFERENCED:
        raise _wrong(
            f"signal {channel.name[:40]!r} has {parts[3][:40]!r} where only {_DIFFERENCED!r} is allowed", word="signal"
        )
    return channel, constant, len(parts) > 3


def encode_spectra_layout(layout: SpectraLayout, rate_hz: float, *, epoch: int = 0, sequence: int = 0) -> bytes:
    """A frame with the layout of spectra; a sender sends it first, and then once a second.

    >>> layout = SpectraLayout((Channel("w", "N m"),), (), window=400, hop=20, lines=(2, 4))
    >>> len(encode_spectra_layout(layout, 4000))
    103
    """
    text = spectra_text(layout)
    count = len(layout.signals) + len(layout.values)
    return framed(SPECTRA_LAYOUT, 0, sequence, epoch, 0, 0, rate_hz, zlib.crc32(text), count, 0, text)


def encode_spectra(batch: SpectraBatch, *, sequence: int = 0, double: bool = False) -> bytes:
    """A frame with the spectra of a batch, as float32, or as float64 with `double`."""
    layout = batch.layout
    dtype = payload_type(layout, double=double)
    rows = np.zeros(len(batch.state), dtype)
    rows["state"], rows["values"] = batch.state, batch.values.T
    sums = batch.sums.transpose(1, 0, 2)
    rows["sums"][..., 0], rows["sums"][..., 1] = sums.real, sums.imag
    late_s = (layout.hop - 1) / batch.rate_hz
    stamp_ns = 0 if batch.stamp_s is None else round((batch.stamp_s + late_s) * 1e9)
    count = len(layout.signals) + len(layout.values)
    return framed(
        SPECTRA, FLOAT64 if double else 0, sequence, batch.epoch, batch.first_sample + layout.hop - 1, stamp_ns,
        batch.rate_hz, zlib.crc32(spectra_text(layout)), count, len(rows), rows.tobytes(),
    )  # fmt: skip


def payload_type(layout: SpectraLayout, *, double: bool) -> np.dtype[Any]:
    """One spectrum in the payload."""
    return _type_of(len(layout.values), len(layout.signals), len(layout.bins), double)


@lru_cache
def _type_of(values: int, signals: int, bins: int, double: bool) -> np.dtype[Any]:
    real = "<f8" if double else "<f4"
    return np.dtype([("state", "<u4"), ("values", real, (values,)), ("sums", real, (signals, bins, 2))])


def read_spectra(header: Header, payload: bytes | memoryview, layout: SpectraLayout, arrived_s: float) -> SpectraBatch:
    """The batch in the payload of a frame; SourceError if it contradicts its header or its layout."""
    count = len(layout.signals) + len(layout.values)
    if header.channels != count:
        raise inconsistent_frame(
            f"a frame of spectra has {header.channels} channels, its layout {count}", channels=[header.channels, count]
        )
    double = bool(header.flags & FLOAT64)
    itemsize = payload_type(layout, double=double).itemsize
    if not header.samples or len(payload) != header.samples * itemsize:
        raise inconsistent_frame(
            f"a frame of {header.samples} spectra of {itemsize} bytes each has {len(payload)} bytes of them",
            spectra=header.samples,
            bytes=len(payload),
        )
    sums, values, states = (read_row if header.samples == 1 else read_rows)(payload, layout, double=double)
    if (state := int(states.max())) > _STATES:
        raise SourceError(
            "value-invalid",
            f"a spectrum has the state {state}, not 0 to {_STATES}",
            "correct the sender",
            key="state",
            value=state,
        )
    return SpectraBatch(
        header.sample + 1 - layout.hop, sums, values, states, layout, header.rate_hz, header.epoch,
        stamp_of(header.stamp_ns, layout.hop, header.rate_hz), arrived_s,
    )  # fmt: skip


def read_rows(
    payload: bytes | memoryview, layout: SpectraLayout, *, double: bool
) -> tuple[NDArray[np.complex128], NDArray[np.float64], NDArray[np.uint32]]:
    """Sums, values and states of consecutive spectra in a payload, as those of a SpectraBatch."""
    rows = np.frombuffer(payload, payload_type(layout, double=double))
    with np.errstate(invalid="ignore"):  # a signalling NaN becomes a quiet one
        sums = rows["sums"].astype(np.float64)
        values = rows["values"].T.astype(np.float64, order="C")
    return complex_of(sums), values, np.array(rows["state"])


def read_row(
    payload: bytes | memoryview, layout: SpectraLayout, *, double: bool
) -> tuple[NDArray[np.complex128], NDArray[np.float64], NDArray[np.uint32]]:
    """The same for a single spectrum, in less time."""
    real, pair = ("<f8", "<c16") if double else ("<f4", "<c8")
    states, values = np.array(np.frombuffer(payload, "<u4", 1)), np.frombuffer(payload, real, len(layout.values), 4)
    sums = np.frombuffer(payload, pair, offset=4 + values.nbytes).reshape(len(layout.signals), 1, -1)
    with np.errstate(invalid="ignore"):  # as above
        return sums.astype(np.complex128), values.astype(np.float64)[:, np.newaxis], states


def stamp_of(stamp_ns: int, hop: int, rate_hz: float) -> float | None:
    """The sender's clock at the first sample of a spectrum: the stamp of its frame is that of the newest."""
    return stamp_ns / 1e9 - ((hop - 1) / rate_hz if rate_hz else 0.0) if stamp_ns else None


def complex_of(pairs: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Sums (signals, spectra, bins) from float64 pairs (spectra, signals, bins, 2)."""
    return np.ascontiguousarray(np.ascontiguousarray(pairs).view(np.complex128)[..., 0].transpose(1, 0, 2))
