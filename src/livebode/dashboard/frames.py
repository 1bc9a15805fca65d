"""Frames: curves for the page as bytes that a browser reads as typed arrays.

| byte | type | what |
|---|---|---|
| 0 | 4 bytes | `LBCV` |
| 4 | u8 | version, 3 |
| 5 | u8 | kind, an index into `KINDS` |
| 6 | u8 | quantity, an index into plant, open loop, closed loop, sensitivity |
| 7 | u8 | axis |
| 8 | u32 | rows |
| 12 | u32 | columns: lines, or points of the model's grid |
| 16 | f64 × rows, each | time in s, schedule, dof |
| then | f32 × rows × columns, each | magnitude in dB, phase in degrees |
| of responses | the same | reach, coherence |
| of newest, moment | the same | reach of the noise alone, reach of noise and distortion |
| end | | zeros up to a multiple of 8 bytes, where the next frame may begin |

Of the kind `fits` there is only JSON after the head, as many bytes as there are rows: one row of every parameter, those
of the fit whose model follows in the same message.

Numbers are little endian, in row order. `reach` is bound/|value|, with the radius of 95 %: the edges of the band are
magnitude + 20·log10(1 ± reach) and phase ± arcsin(reach), undefined for reach ≥ 1. The reach of the noise alone leaves
out distortion, which repeats with the excitation (friction, backlash, encoder steps), and time variation; the reach of
noise and distortion leaves out time variation. A part that is not known counts as zero. Unknown values are NaN.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import CIRCLE_FACTOR, Quantity, Responses, widened, with_distortion
from livebode.dashboard.quantities import QUANTITIES
from livebode.pictures import unwrapped
from livebode.records import to_json

REFERENCES_MAX = 8
KINDS = (
    *("newest", "moment", "reference", "baseline", "model", "rows", "history", "fits"),
    *(f"reference {slot}" for slot in range(2, REFERENCES_MAX + 1)),
)
_HEADER = struct.Struct("<4sBBBBII")
_MAGIC, _VERSION = b"LBCV", 3
_WITH_PARTS = "newest", "moment"  # of others the page shows no parts of the bound
_WHOLE_PHASE_ROWS = 8  # up to this many rows the phase is unwrapped over frequency


def reference_kind(slot: int) -> str:
    """The kind of the frame of a reference; slots begin at 1."""
    return "reference" if slot == 1 else f"reference {slot}"


def frame(kind: str, axis: int, responses: Responses) -> bytes:
    """A frame of responses, already converted to the displayed quantity."""
    rows, columns = responses.value.shape
    use = responses.valid & np.isfinite(responses.value) & (responses.value != 0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        size = np.where(use, np.abs(responses.value), np.nan)
        magnitude = 20 * np.log10(size)
        reach = responses.bound() / size
        phase = np.where(use, np.degrees(np.angle(responses.value)), np.nan)
    if rows <= _WHOLE_PHASE_ROWS:
        phase = np.array([unwrapped(p, np.nan_to_num(r) >= 1) for p, r in zip(phase, reach)]).reshape(rows, columns)
    head = header(kind, axis, responses.quantity, rows, columns)
    times = (responses.time_s, responses.schedule, responses.dof)
    curves = [magnitude, phase, reach, np.where(use, responses.coherence, np.nan)]
    if kind in _WITH_PARTS:
        inner = responses.noise, with_distortion(responses.noise, responses.distortion)
        curves += [widened(part, responses.dof[:, np.newaxis], CIRCLE_FACTOR) / size for part in inner]
    return _packed(head, times, curves)


def curve(kind: str, axis: int, quantity: Quantity, time_s: float, value: np.ndarray[Any, Any]) -> bytes:
    """A frame of one curve without bounds on another grid: a fitted model, shape (points,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        magnitude = 20 * np.log10(np.abs(value))
    phase = unwrapped(np.degrees(np.angle(value)), np.zeros(len(value), dtype=bool))
    unknown = np.array([np.nan])
    head = header(kind, axis, quantity, 1, len(value))
    return _packed(head, (np.array([time_s]), unknown, unknown), (magnitude, phase))


def fits(axis: int, quantity: Quantity, plain: list[dict[str, Any]]) -> bytes:
    """A frame of one row of every parameter."""
    text = to_json(plain).encode()
    data = header("fits", axis, quantity, len(text), 0) + text
    return data + bytes(-len(data) % 8)


def header(kind: str, axis: int, quantity: Quantity, rows: int, columns: int) -> bytes:
    """The first 16 bytes."""
    return _HEADER.pack(_MAGIC, _VERSION, KINDS.index(kind), QUANTITIES.index(quantity), axis, rows, columns)


def _packed(head: bytes, times: Sequence[Floats], curves: Sequence[Floats]) -> bytes:
    parts = [head, *(np.asarray(x, "<f8").tobytes() for x in times), *(np.asarray(x, "<f4").tobytes() for x in curves)]
    data = b"".join(parts)
    return data + bytes(-len(data) % 8)
