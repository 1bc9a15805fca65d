"""The filters of a proposal as text for a controller."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, pi

from livebode.core import PID, Cascade, UsageError
from livebode_control.tuning.filters import Biquad
from livebode_control.tuning.structure import TunedFeedback


def c_header(biquads: Sequence[Biquad]) -> str:
    """A C99 header with the coefficients and a function that computes one filter.

    >>> from livebode_control.tuning.filters import notch
    >>> print(c_header([notch(60.0, 20.0, 0.5, 4000.0)]).splitlines()[0])
    /* Filters in series with the velocity controller, 4000 Hz. y = b0 x + b1 x1 + b2 x2 - a1 y1 - a2 y2. */
    """
    rate = f"{biquads[0].rate_hz:g} Hz" if biquads else "none"
    rows = ",\n".join("    {" + ", ".join(f"{x!r}" for x in (*biquad.b, *biquad.a)) + "}" for biquad in biquads)
    return (
        f"/* Filters in series with the velocity controller, {rate}. y = b0 x + b1 x1 + b2 x2 - a1 y1 - a2 y2. */\n"
        "#ifndef LIVEBODE_FILTERS_H\n#define LIVEBODE_FILTERS_H\n\n"
        f"#define LIVEBODE_FILTERS {len(biquads)}\n"
        "/* b0, b1, b2, a1, a2 */\n"
        f"static const double livebode_filter[][5] = {{\n{rows or '    {1.0, 0.0, 0.0, 0.0, 0.0}'}\n}};\n\n"
        "static inline double livebode_filter_step(const double c[5], double s[2], double x)\n{\n"
        "    double y = c[0] * x + s[0];\n"
        "    s[0] = c[1] * x - c[3] * y + s[1];\n"
        "    s[1] = c[2] * x - c[4] * y;\n"
        "    return y;\n}\n\n#endif\n"
    )


def structured_text(biquads: Sequence[Biquad]) -> str:
    """A function block in Structured Text (TwinCAT, IEC 61131-3), called once in each cycle of the velocity controller.

    >>> from livebode_control.tuning.filters import notch
    >>> print(structured_text([notch(60.0, 20.0, 0.5, 4000.0)]).splitlines()[0])
    FUNCTION_BLOCK FB_LivebodeFilters
    """
    from livebode.structured_text import real

    count = len(biquads)
    body = ["fOut := fIn;"]
    for i, biquad in enumerate(biquads):
        (b0, b1, b2), (a1, a2) = (map(real, part) for part in (biquad.b, biquad.a))
        body += [
            f"fX := fOut; fOut := {b0} * fX + fS[{i}, 0];",
            f"fS[{i}, 0] := {b1} * fX - ({a1}) * fOut + fS[{i}, 1];",
            f"fS[{i}, 1] := {b2} * fX - ({a2}) * fOut;",
        ]
    state = [f"    fS : ARRAY [0..{count - 1}, 0..1] OF LREAL;", "    fX : LREAL;"] if count else []
    return "\n".join(
        [
            "FUNCTION_BLOCK FB_LivebodeFilters",
            *("VAR_INPUT", "    fIn : LREAL;", "END_VAR"),
            *("VAR_OUTPUT", "    fOut : LREAL;", "END_VAR"),
            *(["VAR", *state, "END_VAR"] if state else []),
            *body,
            "END_FUNCTION_BLOCK",
            "",
        ]
    )


def odrive_text(feedback: TunedFeedback) -> str:
    """The gains as commands for odrivetool, in the units of ODrive's firmware from 0.5 on, which count turns.

    For a loop from rad/s to N m: pos_gain in (turn/s)/turn, vel_gain in N m/(turn/s), vel_integrator_gain in
    N m/(turn/s · s). ODrive's firmware 0.4 has other units.

    Raises
    ------
    UsageError
        If the controller is not a cascade of P and PI, or has filters, which ODrive does not compute.

    Examples
    --------
    >>> loop = Cascade(PID(gain=0.1, integral_time_s=0.1, rate_hz=8000), PID(gain=20.0, rate_hz=8000))
    >>> print(odrive_text(TunedFeedback(loop)))
    odrv0.axis0.controller.config.pos_gain = 20
    odrv0.axis0.controller.config.vel_gain = 0.628319
    odrv0.axis0.controller.config.vel_integrator_gain = 6.28319
    <BLANKLINE>
    """
    loop = feedback.controller
    if feedback.biquads or not (isinstance(loop, Cascade) and isinstance(loop.position, PID)):
        raise UsageError(
            "not-one-of",
            "the proposal has filters, or is not a cascade of position and velocity, and ODrive has no such terms",
            "describe both loops, and permit no filters (notches 0, no low-pass)",
            argument="feedback",
        )
    gain = 2 * pi * loop.velocity.gain
    per_second = 1 / loop.velocity.integral_time_s if isfinite(loop.velocity.integral_time_s) else 0.0
    rows = {"pos_gain": loop.position.gain, "vel_gain": gain, "vel_integrator_gain": gain * per_second}
    return "".join(f"odrv0.axis0.controller.config.{name} = {value:.6g}\n" for name, value in rows.items())
