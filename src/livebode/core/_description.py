"""A Response or a batch of them in a line of text, and as a small table for a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from livebode.core.clock import moment

if TYPE_CHECKING:
    from livebode.core._response import Response, Responses
    from livebode.core.lines import Lines

_ROWS_MAX = 24
_HEADS = ("frequency", "magnitude", "phase", "bound (2σ, 98.2 %)", "coherence")


def of_response(response: Response) -> str:
    """
    >>> from livebode import example_responses
    >>> example_responses()[-1]
    <Response: plant in rad/s/(N m), 13 lines, 20 … 140 Hz, all valid, at 0.95 s>
    """
    known = int(np.count_nonzero(response.valid))
    valid = "all valid" if known == len(response.lines) else f"{known} valid"
    return f"<Response: {_named(response)}, {_span(response.lines)}, {valid}, at {moment(response.time_s, 2)}>"


def of_responses(many: Responses) -> str:
    """
    >>> from livebode import example_responses
    >>> example_responses()
    <Responses: 40 of plant in rad/s/(N m), 37 valid, 13 lines, 20 … 140 Hz, 0.05 s … 0.95 s>
    """
    if not len(many):
        return f"<Responses: none of {_named(many)}, {_span(many.lines)}>"
    valid = np.flatnonzero(many.valid.any(axis=1))
    # The windows of the first responses begin before the recording, and so may their effective times.
    time_s = many.time_s[valid] if valid.size else many.time_s
    times = f"{moment(time_s[0], 2)} … {moment(time_s[-1], 2)}"
    return f"<Responses: {len(many)} of {_named(many)}, {len(valid)} valid, {_span(many.lines)}, {times}>"


def table_of_response(response: Response) -> str:
    """HTML: a row for each line, thinned to `_ROWS_MAX`; lines that are not valid are grey."""
    count = len(response.lines)
    shown = np.unique(np.linspace(0, count - 1, min(count, _ROWS_MAX)).round().astype(int))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = response.bound(2) / np.abs(response.value)
    values = (
        response.frequency_hz,
        response.magnitude_db,
        response.phase_deg,
        share,
        response.coherence,
        response.valid,
    )
    rows = [_row(*row) for row in zip(*(part[shown] for part in values))]
    thinned = f"<caption>{len(rows)} of {count} lines</caption>" if len(rows) < count else ""
    heads = "".join(f"<th>{head}</th>" for head in _HEADS)
    return f"{_paragraph(of_response(response))}<table>{thinned}<thead><tr>{heads}</tr></thead>{''.join(rows)}</table>"


def table_of_responses(many: Responses) -> str:
    """HTML: all in a line, and the newest valid one as a table."""
    newest = many.newest()
    return _paragraph(of_responses(many)) + ("" if newest is None else table_of_response(newest))


def _row(f: float, db: float, deg: float, share: float, coherence: float, valid: bool) -> str:
    cells = (f"{f:.6g} Hz", f"{db:.2f} dB", f"{deg:.1f}°", f"{100 * share:.2g} %", f"{coherence:.3f}")
    look = "" if valid else ' style="opacity: 0.4"'
    return f"<tr{look}>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _paragraph(text: str) -> str:
    from html import escape  # its table of entities is loaded for a notebook only

    return f"<div>{escape(text)}</div>"


def _named(of: Response | Responses) -> str:
    return f"{of.quantity} in {of.unit}" if of.unit else str(of.quantity)


def _span(lines: Lines) -> str:
    f = lines.frequency_hz
    if len(f) == 1:
        return f"1 line, {f[0]:g} Hz"
    return f"{len(f)} lines, {f[0]:g} … {f[-1]:g} Hz"
