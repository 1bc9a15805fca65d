"""An input shaper as text for a printer or a controller."""

from __future__ import annotations

from typing import Literal

from livebode_control.tuning.input_shaper import InputShaper

KLIPPER_KINDS = ("zv", "zvd", "ei")


def klipper_text(shaper: InputShaper, axis: Literal["x", "y", "z"] = "x") -> str:
    """The section `[input_shaper]` of Klipper's configuration, for one of the kinds that it has.

    Its keys are those of Klipper's configuration reference (2024); it computes the impulses itself.

    >>> from livebode_control.tuning.input_shaper import zvd
    >>> print(klipper_text(zvd(43.2, 0.04)))
    [input_shaper]
    shaper_type_x: zvd
    shaper_freq_x: 43.20
    damping_ratio_x: 0.0400
    <BLANKLINE>
    """
    return (
        f"[input_shaper]\nshaper_type_{axis}: {shaper.kind}\nshaper_freq_{axis}: {shaper.frequency_hz:.2f}\n"
        f"damping_ratio_{axis}: {shaper.damping:.4f}\n"
    )


def c_header(shaper: InputShaper, rate_hz: float) -> str:
    """A C99 header: the impulses as weights of past samples of the reference, and a function for one sample."""
    taps = [(n, float(a)) for n, a in enumerate(shaper.taps(rate_hz)) if a]
    samples = taps[-1][0] + 1
    rows = ",\n".join(f"    {{{n}, {a!r}}}" for n, a in taps)
    return (
        f"/* Input shaper {shaper.kind} at {rate_hz:g} Hz for a mode at {shaper.frequency_hz:.6g} Hz, damping "
        f"{shaper.damping:.4g}. */\n"
        "#ifndef LIVEBODE_SHAPER_H\n#define LIVEBODE_SHAPER_H\n\n"
        f"#define LIVEBODE_SHAPER_SAMPLES {samples}\n"
        "typedef struct { int delay; double weight; } livebode_tap;\n"
        f"static const livebode_tap livebode_taps[{len(taps)}] = {{\n{rows}\n}};\n\n"
        "/* memory: LIVEBODE_SHAPER_SAMPLES past references, all set to the first one before; next: begins with 0. */\n"
        "static inline double livebode_shape(double memory[], int *next, double reference)\n{\n"
        "    double sum = 0.0;\n"
        "    memory[*next] = reference;\n"
        f"    for (int i = 0; i < {len(taps)}; i++) {{\n"
        "        int at = *next - livebode_taps[i].delay;\n"
        "        sum += livebode_taps[i].weight * memory[at < 0 ? at + LIVEBODE_SHAPER_SAMPLES : at];\n"
        "    }\n"
        "    *next = *next + 1 == LIVEBODE_SHAPER_SAMPLES ? 0 : *next + 1;\n"
        "    return sum;\n}\n\n#endif\n"
    )


def structured_text(shaper: InputShaper, rate_hz: float) -> str:
    """A function block in Structured Text (IEC 61131-3), called once in each cycle with the reference.

    >>> from livebode_control.tuning.input_shaper import zv
    >>> print(structured_text(zv(50.0), 1000.0).splitlines()[0])
    FUNCTION_BLOCK FB_LivebodeShaper
    """
    from livebode.structured_text import real

    taps = [(n, float(a)) for n, a in enumerate(shaper.taps(rate_hz)) if a]
    samples = taps[-1][0] + 1
    sums = [f"fOut := fOut + {real(a)} * fMemory[(nNext + {samples - n}) MOD {samples}];" for n, a in taps]
    return "\n".join(
        [
            "FUNCTION_BLOCK FB_LivebodeShaper",
            *("VAR_INPUT", "    fIn : LREAL;", "END_VAR"),
            *("VAR_OUTPUT", "    fOut : LREAL;", "END_VAR"),
            "VAR",
            f"    fMemory : ARRAY [0..{samples - 1}] OF LREAL;",
            *("    nNext : INT;", "    nFill : INT;", "    bFilled : BOOL;"),
            "END_VAR",
            "IF NOT bFilled THEN",
            f"    FOR nFill := 0 TO {samples - 1} DO",
            *("        fMemory[nFill] := fIn;", "    END_FOR", "    bFilled := TRUE;", "END_IF"),
            *("fMemory[nNext] := fIn;", "fOut := 0.0;", *sums),
            f"nNext := (nNext + 1) MOD {samples};",
            "END_FUNCTION_BLOCK",
            "",
        ]
    )
