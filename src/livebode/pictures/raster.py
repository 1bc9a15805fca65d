"""Cells as a small PNG with a palette, as a part of an SVG."""

from __future__ import annotations

import struct
import zlib
from base64 import b64encode

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.pictures.figure import Cells

Bytes = NDArray[np.uint8]

_NOTHING = (138, 147, 157, 90)
"""A grey that is seen on light and on dark paper."""
_DOWN, _UP = (45, 120, 195), (208, 56, 60)
# The colours of Matplotlib's viridis as polynomials of sixth degree for red, green and blue, to ± 0.01 (M. Zucker).
_VIRIDIS = (
    (0.2777273, 0.0054073, 0.3340998), (0.1050930, 1.4046135, 1.3845902), (-0.3308618, 0.2148476, 0.0950952),
    (-4.6342305, -5.7991010, -19.3324410), (6.2282699, 14.1799334, 56.6905526), (4.7763850, -13.7451454, -65.3530326),
    (-5.4354559, 4.6458526, 26.3124353),
)  # fmt: skip


def cells_png(cells: Cells, rows_hz: Floats) -> bytes:
    """The picture of cells whose rows are found at `rows_hz`, from below, as PNG: the lowest row is the last."""
    row = np.clip(np.searchsorted(cells.y, rows_hz, side="right") - 1, 0, cells.values.shape[1] - 1)
    shown = cells.values[:, row].T[::-1]
    low, high = cells.limits
    share = np.clip((shown - low) / (high - low), 0.0, 1.0)
    known = np.isfinite(shown)
    index = np.where(known, 1 + np.rint(254 * np.where(known, share, 0.0)), 0).astype(np.uint8)
    return _png(index, _palette(cells.colours))


def data_url(png: bytes) -> str:
    """The picture as an address that contains it."""
    return f"data:image/png;base64,{b64encode(png).decode()}"


def _palette(colours: str) -> Bytes:
    """Red, green, blue and opacity of NaN and of 255 shares, (256, 4)."""
    share = np.linspace(0.0, 1.0, 255)
    if colours == "level":
        rgb = sum(np.outer(share**i, factor) for i, factor in enumerate(_VIRIDIS))
        known = np.column_stack([np.clip(np.rint(255 * np.asarray(rgb)), 0, 255), np.full(255, 255.0)])
    else:
        away = np.abs(2 * share - 1)
        known = np.column_stack([np.where(share[:, np.newaxis] < 0.5, _DOWN, _UP), np.rint(255 * away)])
    return np.vstack([_NOTHING, known]).astype(np.uint8)


def _png(index: Bytes, palette: Bytes) -> bytes:
    """Rows are differences from the row above, which are mostly zeros (PNG specification, 9.2)."""
    above = np.vstack([np.zeros((1, index.shape[1]), dtype=np.uint8), index[:-1]])
    lines = np.column_stack([np.full(len(index), 2, dtype=np.uint8), index - above])
    size = struct.pack(">IIBBBBB", index.shape[1], index.shape[0], 8, 3, 0, 0, 0)
    parts = ((b"IHDR", size), (b"PLTE", palette[:, :3].tobytes()), (b"tRNS", palette[:, 3].tobytes()),
             (b"IDAT", zlib.compress(lines.tobytes(), 6)), (b"IEND", b""))  # fmt: skip
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in parts
    )
