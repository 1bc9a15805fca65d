"""A configuration against the spectra that its drive sends: what is asked otherwise, or needs samples, is refused."""

from __future__ import annotations

from livebode.core import InputError, Lines, SpectraLayout
from livebode.session.axis import Axis


def check_spectra(axis: Axis, layout: SpectraLayout, rate_hz: float) -> Lines:
    """The lines of the spectra; InputError where the configuration says others, or asks for what needs samples."""
    frequencies, window, hop = axis.lines.frequencies, axis.lines.window, axis.tracking.hop
    if axis.motion is not None:
        raise InputError(
            "[motion] drives its model with samples, and the drive sends spectra; leave it out, or send samples"
        )
    if axis.record is not None and axis.record.samples:
        raise InputError("record.samples keeps samples, and the drive sends spectra; leave it out, or send samples")
    if window not in ("auto", layout.window):
        raise InputError(f"lines.window is {window}, and the drive's is {layout.window}; take that, or leave it out")
    if hop not in (None, layout.hop):
        raise InputError(f"tracking.hop is {hop}, and the drive's is {layout.hop}; take that, or leave it out")
    lines = layout.at(rate_hz)
    if frequencies != "auto" and Lines.parse(frequencies, rate_hz, layout.window).bins != layout.lines:
        f = ", ".join(f"{x:g}" for x in lines.frequency_hz[:20])
        more = f" … ({len(lines)} lines)" if len(lines) > 20 else ""
        raise InputError(
            f"lines.frequencies are {frequencies!r}, and the drive's are {f}{more} Hz; take those, or leave them out"
        )
    return lines
