"""FB_SlidingDft: the kernel's modulated sliding DFT in Structured Text."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial
from typing import Literal

from livebode.core import Lines, UsageError
from livebode.structured_text import Declared, array, check_bytes, check_name, check_names, comment, real, section

CHANNELS_MAX = 16
"""Most channels of one block."""
_FILL = """\
IF filled < {window} THEN
    // An entry of the table: cos and sin of 2*pi*filled/N, reduced to an eighth of the circle in integers.
    IF filled = 0 THEN
{bins}
    END_IF
    folded := filled;
    IF 2 * filled > {window} THEN
        folded := {window} - filled;
    END_IF
    octant := (8 * folded) / {window};
    rest := (8 * folded) MOD {window};
    IF octant MOD 2 = 1 THEN
        rest := {window} - rest;
    END_IF
    angle := 0.7853981633974483 * (UDINT_TO_LREAL(rest) / {window}.0);
    square := angle * angle;
{sin}
    small_sin := angle + angle * (square * poly);
{cos}
    small_cos := 1.0 - square * (0.5 - square * poly);
    IF (octant = 1) OR (octant = 2) THEN
        cosine[filled] := small_sin;
        sine[filled] := small_cos;
    ELSE
        cosine[filled] := small_cos;
        sine[filled] := small_sin;
    END_IF
    IF octant > 1 THEN
        cosine[filled] := -cosine[filled];
    END_IF
    IF 2 * filled > {window} THEN
        sine[filled] := -sine[filled];
    END_IF
    filled := filled + 1;
    RETURN;
END_IF
"""

_STEP = """
{fresh}
FOR channel := 0 TO {last_channel} DO
    difference := fresh[channel] - line[channel, index];
    line[channel, index] := fresh[channel];
    FOR bin := 0 TO {last_bin} DO
        {re}[channel, bin] := {re}[channel, bin] + cosine[place[bin]] * difference;
        {im}[channel, bin] := {im}[channel, bin] - sine[place[bin]] * difference;
    END_FOR
    // The sum of this period alone: a sample of its second half and its mirror image have the same cos and sin.
    IF index >= {half} THEN
        IF index = {half} THEN
            FOR bin := 0 TO {last_bin} DO
                f_re[channel, bin] := line[channel, 0];
                f_im[channel, bin] := 0.0;
            END_FOR
        END_IF
        even := fresh[channel];
        odd := fresh[channel];
        IF 2 * index > {window} THEN
            even := fresh[channel] + line[channel, {window} - index];
            odd := fresh[channel] - line[channel, {window} - index];
        END_IF
        FOR bin := 0 TO {last_bin} DO
            f_re[channel, bin] := f_re[channel, bin] + cosine[place[bin]] * even;
            f_im[channel, bin] := f_im[channel, bin] - sine[place[bin]] * odd;
        END_FOR
        // At its end it replaces the sliding sum: rounding, spikes and NaN are never older than two periods.
        IF index = {last} THEN
            FOR bin := 0 TO {last_bin} DO
                {re}[channel, bin] := f_re[channel, bin];
                {im}[channel, bin] := f_im[channel, bin];
            END_FOR
        END_IF
    END_IF
END_FOR

FOR bin := 0 TO {last_bin} DO
    place[bin] := place[bin] + bins[bin];
    IF place[bin] >= {window} THEN
        place[bin] := place[bin] - {window};
    END_IF
END_FOR
index := index + 1;
IF index = {window} THEN
    index := 0;
END_IF
count := count + 1;
valid := count >= {window};
"""

_TURN = """\
// From the fixed grid to the window's own phase: that of the FFT of the last N samples, oldest first.
FOR channel := 0 TO {last_channel} DO
    FOR bin := 0 TO {last_bin} DO
        re[channel, bin] := s_re[channel, bin] * cosine[place[bin]] - s_im[channel, bin] * sine[place[bin]];
        im[channel, bin] := s_im[channel, bin] * cosine[place[bin]] + s_re[channel, bin] * sine[place[bin]];
    END_FOR
END_FOR
"""


def sliding_dft(
    lines: Lines,
    channels: Sequence[str],
    *,
    name: str = "FB_SlidingDft",
    phase: Literal["fixed", "window"] = "fixed",
) -> str:
    """Text of a function block that computes the DFT of the last N samples at the lines, for channels with one index.

    The operations are those of `livebode.kernel.SlidingDFT` in float64 (docs/reference/kernel.md), so the results have
    the same bits if the PLC rounds every product and sum to 64 bits. It is called once per cycle with a sample of each
    channel; the outputs `re` and `im` are [channel, bin]. It first fills its table, one entry per cycle, and processes
    samples after N cycles; `count` is their number, and `valid` is true from the Nth.

    Parameters
    ----------
    lines
        The bins, and the window N.
    channels
        Names of the inputs: at most 16, valid in Structured Text.
    name
        Name of the function block.
    phase
        "fixed": referred to sample counts that are multiples of N; ratios between channels are the same, without
        extra cost. "window": that of numpy.fft of the window, with six more operations per bin, channel and sample.

    Raises
    ------
    UsageError
        If a name is not valid in Structured Text, there is no channel or more than 16, or the window needs more than
        8 MiB.

    Examples
    --------
    >>> text = sliding_dft(Lines((2, 4), window=16, rate_hz=4000), ["w", "u", "y"])
    >>> print(text.splitlines()[0])
    // Sliding DFT of the last 16 samples at 4000 Hz: bins 2, 4, that is 500, 1000 Hz
    """
    check_name(name, "function block")
    if phase not in ("fixed", "window"):
        raise UsageError(
            "not-one-of",
            f"{phase=} is not supported",
            "use 'fixed' or 'window'",
            argument="phase",
            value=phase,
            allowed=["fixed", "window"],
        )
    if not 1 <= len(channels) <= CHANNELS_MAX:
        raise UsageError(
            "out-of-range",
            f"channels {list(channels)} are not 1 to {CHANNELS_MAX} names",
            "use several blocks",
            argument="channels",
            value=list(channels),
        )
    bins, window = len(lines), lines.window
    outputs, own = _outputs(len(channels), bins), _own(len(channels), bins, window, phase)
    check_names(channels, "channel", [name, *(v for names, _, _ in (*outputs, *own) for v in names.split(", "))])
    check_bytes(8 * len(channels) * bins * 6, 8 * (2 + len(channels)), window, "a sliding DFT")
    sums = ("re", "im") if phase == "fixed" else ("s_re", "s_im")
    numbers = {
        "window": window,
        "half": (window + 1) // 2,
        "last": window - 1,
        "last_bin": bins - 1,
        "last_channel": len(channels) - 1,
        "re": sums[0],
        "im": sums[1],
        "sin": _taylor(f"poly := {real(1 / factorial(17))};", range(15, 2, -2)),
        "cos": _taylor(f"poly := {real(1 / factorial(16))} - {real(1 / factorial(18))} * square;", range(14, 3, -2)),
        "bins": "\n".join(f"        bins[{i}] := {k};" for i, k in enumerate(lines.bins)),
        "fresh": "\n".join(f"fresh[{i}] := {channel};" for i, channel in enumerate(channels)),
    }
    body = _FILL + _STEP + (_TURN if phase == "window" else "")
    return (
        _heading(lines, channels)
        + f"FUNCTION_BLOCK {name}\n"
        + section("VAR_INPUT", [(channel, "LREAL", "") for channel in channels])
        + section("VAR_OUTPUT", outputs)
        + section("VAR", own)
        + "\n"
        + body.format(**numbers)
        + "END_FUNCTION_BLOCK\n"
    )


def _taylor(start: str, orders: range) -> str:
    """Horner's rule from `start`; the reciprocal factorials of `orders` are alternately subtracted and added."""
    lines = [start]
    for i, order in enumerate(orders):
        lines.append(f"poly := poly * square {'+' if i % 2 else '-'} {real(1 / factorial(order))};")
    return "\n".join(" " * 4 + line for line in lines)


def _heading(lines: Lines, channels: Sequence[str]) -> str:
    return comment(
        f"Sliding DFT of the last {lines.window} samples at {lines.rate_hz:g} Hz: "
        f"bins {', '.join(map(str, lines.bins))}, that is {', '.join(f'{f:g}' for f in lines.frequency_hz)} Hz\n"
        f"re and im are [channel, bin]; channels: {', '.join(f'{i} {name}' for i, name in enumerate(channels))}"
    )


def _outputs(channels: int, bins: int) -> list[Declared]:
    sums = array(channels, bins)
    return [
        ("re", sums, "the spectra"),
        ("im", sums, ""),
        ("count", "ULINT", "samples taken"),
        ("valid", "BOOL", "a complete window was processed"),
    ]


def _own(channels: int, bins: int, window: int, phase: str) -> list[Declared]:
    sums = array(channels, bins)
    turned = [("s_re", sums, "sums over the window"), ("s_im", sums, "")] if phase == "window" else []
    return [
        ("bins", array(bins, of="UDINT"), ""),
        ("cosine", array(window), "of 2*pi*r/N"),
        ("sine", array(window), ""),
        ("line", array(channels, window), "the last N samples, by index"),
        *turned,
        ("f_re", sums, "sums over this period alone"),
        ("f_im", sums, ""),
        ("fresh", array(channels), ""),
        ("place", array(bins, of="UDINT"), "bin * index mod N"),
        ("index", "UDINT", "index in the period"),
        ("filled", "UDINT", "entries of the table"),
        ("channel, bin, folded, octant, rest", "UDINT", ""),
        ("angle, square, poly, small_cos, small_sin", "LREAL", ""),
        ("difference, even, odd", "LREAL", ""),
    ]
