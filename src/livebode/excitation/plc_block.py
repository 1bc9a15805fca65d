"""FB_Multisine: one exact period of an excitation, repeated, ramped up and down at the period's borders."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core import UsageError, rounded_down
from livebode.structured_text import SMALLEST, array, check_name, check_rate, comment, real, section

BLOCK_PERIOD_MAX = 16384
"""Longest period, samples: each is a line of text that the PLC's compiler reads."""
RAMP_PERIODS_MAX = (2**32 - 1) // BLOCK_PERIOD_MAX
"""Longest ramp: its samples are counted in a UDINT."""
_LOADED_AT_ONCE = 32  # samples per cycle while the table is filled, so that the first cycle is as short as the others

_BELOW = 1 - 1e-12  # so that rounding of the scaled samples does not exceed the limit

_BODY = """\
IF loaded < {chunks} THEN
    CASE loaded OF
{table}
    END_CASE
    loaded := loaded + 1;
END_IF

IF index = 0 THEN
    IF level > 0 THEN
        rising := enable;
    ELSE
        allowed := (w_max / {peak}) * {below};
        refused := enable AND NOT (ABS(scale) * {peak} <= w_max);
        rising := enable AND NOT refused AND (loaded = {chunks});
        IF rising THEN
            applied := scale;
            limited := FALSE;
        END_IF
    END_IF
END_IF
IF stop THEN
    rising := FALSE;
    level := 0;
END_IF

steady := rising AND (level = {ramp});
IF steady THEN
    w := table[index] * applied;
ELSIF level > 0 THEN
    w := table[index] * (applied * UDINT_TO_LREAL(level) / {ramp}.0);
ELSE
    w := 0.0;
END_IF
IF NOT (ABS(w) <= w_max) THEN
    limited := TRUE;
    IF NOT (w_max > 0.0) THEN
        w := 0.0;
    ELSIF w > 0.0 THEN
        w := w_max;
    ELSE
        w := -w_max;
    END_IF
END_IF

IF rising AND (level < {ramp}) THEN
    level := level + 1;
ELSIF NOT rising AND (level > 0) THEN
    level := level - 1;
END_IF
sample := counted;
counted := counted + 1;
index := index + 1;
IF index = {window} THEN
    index := 0;
END_IF
"""


def function_block(
    period: ArrayLike,
    *,
    rate_hz: float,
    limit: float,
    name: str = "FB_Multisine",
    ramp_periods: int = 1,
    note: str = "",
) -> str:
    """Text of a function block that outputs one period repeatedly, one sample per call.

    Any period is possible (`livebode.excitation.multisine` creates one from lines, amplitudes and phases). The sample
    at index n of every period has the same bits. n counts calls since the program's start, also while the output is
    zero: sample numbers that are multiples of the period are its borders. After enable, the block waits for the next
    border; then it ramps up linearly over `ramp_periods` periods. After the end of enable, it ramps down from the next
    border.

    Parameters
    ----------
    period
        One period, shape (samples,), in the drive's unit.
    rate_hz
        Calls per second.
    limit
        Limit of |w|, unit of `period`: default of the block's input w_max. A scale that would exceed it is rejected at
        the start; if w_max is lowered later, w is clamped, and `limited` reports it.
    name
        Name of the function block.
    ramp_periods
        Periods of a ramp.
    note
        Lines for the top of the file: the seed, the author.

    Raises
    ------
    UsageError
        If the period does not have 2 to 16384 finite samples, is zero or exceeds the limit, or the name is not valid in
        Structured Text.

    Examples
    --------
    >>> print(function_block([0.0, 1.0, 0.0, -1.0], rate_hz=1000, limit=1.5).splitlines()[0])
    // 4 samples at 1000 Hz are a period of 0.004 s; peak 1, crest factor 1.414
    """
    check_name(name, "function block")
    samples = _checked(period)
    if not (np.isfinite(limit) and limit > 0):
        raise UsageError(
            "out-of-range",
            f"{limit=} is not a finite number above 0",
            "give the limit of drive and machine",
            argument="limit",
            value=limit,
        )
    check_rate(rate_hz)
    if not 1 <= ramp_periods <= RAMP_PERIODS_MAX:
        raise UsageError(
            "out-of-range",
            f"{ramp_periods=} is not from 1 to {RAMP_PERIODS_MAX} periods",
            "1 is enough for most axes",
            argument="ramp_periods",
            value=ramp_periods,
        )
    peak = float(np.max(np.abs(samples)))
    if peak > limit:
        scale = rounded_down(limit / peak * _BELOW)
        raise UsageError(
            "conflict",
            f"the excitation's peak of {peak:.6g} exceeds {limit=:.6g}",
            f"scale it by at most {scale:g}, or raise the limit",
            argument="limit",
            value=limit,
            peak=peak,
            scale_max=scale,
        )
    chunks = [samples[i : i + _LOADED_AT_ONCE] for i in range(0, len(samples), _LOADED_AT_ONCE)]
    return (
        _heading(samples, rate_hz, note)
        + f"FUNCTION_BLOCK {name}\n"
        + _declarations(len(samples), limit)
        + "\n"
        + _BODY.format(
            table="\n".join(_case(i, chunk) for i, chunk in enumerate(chunks)),
            chunks=len(chunks),
            peak=real(peak),
            below=real(_BELOW),
            ramp=ramp_periods * len(samples),
            window=len(samples),
        )
        + "END_FUNCTION_BLOCK\n"
    )


def _checked(period: ArrayLike) -> NDArray[np.float64]:
    samples = np.asarray(period, dtype=np.float64)
    if samples.ndim != 1 or not 2 <= len(samples) <= BLOCK_PERIOD_MAX:
        raise UsageError(
            "wrong-shape",
            f"a period of shape {samples.shape} is not one of 2 to {BLOCK_PERIOD_MAX} samples",
            "give one period, at a lower rate or with lines further apart",
            argument="period",
            shape=list(samples.shape),
            samples_max=BLOCK_PERIOD_MAX,
        )
    if not np.all(np.isfinite(samples)):
        bad = int(np.flatnonzero(~np.isfinite(samples))[0])
        raise UsageError(
            "not-finite",
            f"sample {bad} of the period is {samples[bad]}",
            "give finite numbers",
            argument="period",
            sample=bad,
        )
    if (peak := float(np.max(np.abs(samples)))) < SMALLEST:
        raise UsageError(
            "out-of-range",
            f"the period is nowhere larger than {peak}",
            "give an excitation",
            argument="period",
            value=peak,
        )
    return samples


def _heading(samples: NDArray[np.float64], rate_hz: float, note: str) -> str:
    peak = float(np.max(np.abs(samples)))
    crest = 1 / float(np.sqrt(np.mean((samples / peak) ** 2)))
    return comment(
        f"{len(samples)} samples at {rate_hz:g} Hz are a period of {len(samples) / rate_hz:.6g} s; "
        f"peak {peak:.6g}, crest factor {crest:.4g}\n{note}"
    )


def _declarations(window: int, limit: float) -> str:
    return (
        section(
            "VAR_INPUT",
            [
                ("enable", "BOOL", "begin at the next border of a period; end at the next border after it falls"),
                ("stop", "BOOL", "w = 0 at once, without a ramp"),
                ("scale", "LREAL := 1.0", "applied when a ramp up begins"),
                ("w_max", f"LREAL := {real(limit)}", "limit of the magnitude of w"),
            ],
        )
        + section(
            "VAR_OUTPUT",
            [
                ("w", "LREAL", "the excitation"),
                ("sample", "ULINT", "number of this sample: calls before this one"),
                ("steady", "BOOL", "w is exactly periodic: no ramp"),
                ("refused", "BOOL", "not started: this scale would exceed the limit"),
                ("allowed", "LREAL", "the largest scale within the limit, less 1E-12 of it"),
                ("limited", "BOOL", "w was clamped since the ramp up began"),
            ],
        )
        + section(
            "VAR",
            [
                ("table", array(window), "one period"),
                ("loaded", "UDINT", "loaded parts of the table"),
                ("index", "UDINT", "index in the period"),
                ("level", "UDINT", "level of the ramp, in samples"),
                ("rising", "BOOL", "ramping up, or at full level"),
                ("applied", "LREAL", "scale since the ramp up began"),
                ("counted", "ULINT", "calls"),
            ],
        )
    )


def _case(number: int, chunk: NDArray[np.float64]) -> str:
    first = number * _LOADED_AT_ONCE
    stores = "\n".join(f"            table[{first + i}] := {real(value)};" for i, value in enumerate(chunk))
    return f"        {number}:\n{stores}"
