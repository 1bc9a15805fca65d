"""Files of an excitation by suffix: CSV, WAV, NumPy, MATLAB, a C header, a function block for a PLC."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np

from livebode.core import DesignError, UsageError, needing, whole_file
from livebode.excitation import Waveform, function_block
from livebode.structured_text import check_name
from livebode.version import __version__

LETTERS_MAX = {"C": 63, "MATLAB": 31}  # significant in C99; in a struct's name of a MATLAB v5 file
_C = """
auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while alignas alignof
bool constexpr false nullptr static_assert thread_local true typeof typeof_unqual asm fortran main
and and_eq bitand bitor catch class compl const_cast delete dynamic_cast explicit export friend mutable namespace new
not not_eq operator or or_eq private protected public reinterpret_cast static_cast template this throw try typeid
typename using virtual wchar_t xor xor_eq
NULL EOF INFINITY NAN I assert errno stdin stdout stderr offsetof va_arg va_start va_end
"""
_MATLAB = """
break case catch classdef continue else elseif end for function global if otherwise parfor persistent return spmd
switch try while
"""
KEYWORDS = {"C": frozenset(_C.split()), "MATLAB": frozenset(_MATLAB.split())}
_TEXT_BYTES = 116  # header text of a v5 file, free except for its first four bytes
_PER_ROW = 4


def facts(waveform: Waveform) -> dict[str, Any]:
    """Plain data: program, rate, window, lines in bins, peak, and the parameters with the seed."""
    lines = waveform.lines
    return {
        "made_by": f"livebode {__version__} design",
        **waveform.about,
        "rate_hz": lines.rate_hz,
        "window": lines.window,
        "bins": list(lines.bins),
        "unit": "N m",
        "peak": waveform.peak,
        "rms": waveform.rms,
        "crest_factor": waveform.crest_factor,
    }


def as_lines(known: Mapping[str, Any]) -> list[str]:
    """Each fact as a line of text, its value as JSON."""
    return [f"{key}: {json.dumps(value)}" for key, value in known.items()]


def write_csv(path: Path, waveform: Waveform, name: str) -> None:
    """Columns ``time [s]`` and the name with its unit; every number is the shortest decimal with the same double.

    ``open_log`` reads it back as a recording.
    """
    if not name.isprintable() or not name.strip() or set(name) & set(',;"\t[]#%'):
        raise DesignError(
            "name-forbidden",
            f"{name=} cannot head a column of a CSV file",
            "choose letters, digits and underscores",
            argument="name",
            name=name,
        )
    head = [f"# {line}" for line in as_lines(facts(waveform))]
    rate_hz = waveform.lines.rate_hz
    rows = (f"{n / rate_hz!r},{value!r}" for n, value in enumerate(waveform.samples.tolist()))
    path.write_text("\n".join([*head, f"time [s],{name} [N m]", *rows]) + "\n", encoding="utf-8")


def _arrays(waveform: Waveform) -> dict[str, Any]:
    lines = waveform.lines
    bins = list(lines.bins)
    return {
        "samples": waveform.samples,
        "frequency_hz": lines.frequency_hz,
        "amplitude": waveform.amplitude,
        "phase": np.angle(waveform.spectrum[bins]) + np.pi / 2,  # of sines, as in eq. (6)
        "rate_hz": lines.rate_hz,
        "facts": json.dumps(facts(waveform)),
    }


def write_npz(path: Path, waveform: Waveform, name: str) -> None:
    """Arrays `samples` (window,), `frequency_hz`, `amplitude` and `phase` (lines,), `rate_hz`, `name`, `facts`."""
    with path.open("wb") as file:  # NumPy adds a suffix to a path
        np.savez(file, name=name, **_arrays(waveform))


def write_mat(path: Path, waveform: Waveform, name: str) -> None:
    """A MATLAB v5 file with one struct of that name; its arrays are columns, `Ts` is the sample time in seconds."""
    arrays = _arrays(waveform)
    columns = {key: value[:, np.newaxis] if np.ndim(value) else value for key, value in arrays.items()}
    write_struct(path, columns | {"Ts": 1 / waveform.lines.rate_hz}, name)


def write_struct(path: Path, struct: Mapping[str, Any], name: str) -> None:
    """A MATLAB v5 file with one struct of that name."""
    with needing("SciPy", "analysis", "a design for MATLAB"):
        from scipy.io import savemat

    savemat(path, {identifier(name, "MATLAB"): struct}, appendmat=False)
    with path.open("r+b") as file:  # instead of the time of day, so that the same design gives the same file
        file.write(b"MATLAB 5.0 MAT-file, written by livebode".ljust(_TEXT_BYTES))


def write_wav(path: Path, waveform: Waveform, name: str) -> None:  # noqa: ARG001
    """One channel of 32-bit floats in N m, so that 1.0 is 1 N m, for a generator that repeats it.

    A file of this form has a whole number of samples per second, and no name.
    """
    rate_hz = waveform.lines.rate_hz
    if rate_hz % 1:
        raise DesignError(
            "format-impossible",
            f"a WAV file has a whole number of samples per second, and the rate is {rate_hz!r} Hz",
            "choose another format",
            argument="suffixes",
            rate_hz=rate_hz,
        )
    with needing("SciPy", "analysis", "a design as a WAV file"):
        from scipy.io import wavfile

    wavfile.write(path, int(rate_hz), waveform.samples.astype(np.float32))


def write_c_header(path: Path, waveform: Waveform, name: str) -> None:
    """``name[NAME_SAMPLES]`` in N m and ``name_bins[NAME_LINES]``; values in hexadecimal, so exactly the doubles.

    The table's type is double, or what NAME_TYPE is defined to before the header is included (float, for a drive
    without double precision: the compiler rounds once).
    """
    word = identifier(name)
    big = word.upper()
    lines = waveform.lines
    # Facts may contain the end of a comment.
    comment = "\n".join(f" * {line}".replace("*/", "* /") for line in as_lines(facts(waveform)))
    values = [float(value).hex() for value in waveform.samples]
    text = f"""/* One period of an excitation, N m.
{comment}
 */
#ifndef {big}_H
#define {big}_H

#ifndef {big}_TYPE
#define {big}_TYPE double
#endif

#define {big}_SAMPLES {lines.window}
#define {big}_LINES {len(lines)}
#define {big}_RATE_HZ {lines.rate_hz!r}
#define {big}_RAMP_PERIODS {waveform.ramp_periods}
#define {big}_PEAK_N_M {waveform.peak.hex()}

static const {big}_TYPE {word}[{big}_SAMPLES] = {{
{c_rows(values)}
}};

static const unsigned {word}_bins[{big}_LINES] = {{
{c_rows([f"{k}u" for k in lines.bins])}
}};

#endif
"""
    path.write_text(text, encoding="ascii")


def c_rows(values: list[str]) -> str:
    """The values of a table in C."""
    rows = (values[i : i + _PER_ROW] for i in range(0, len(values), _PER_ROW))
    return ",\n".join("    " + ", ".join(row) for row in rows)


def write_st(path: Path, waveform: Waveform, name: str) -> None:
    """``FB_name``, limited to the period's own peak by default (w_max); the values are exactly the doubles."""
    check_name(name, "excitation")
    note = "\n".join(as_lines(facts(waveform)))
    text = function_block(
        waveform.samples, rate_hz=waveform.lines.rate_hz, limit=waveform.peak, name=f"FB_{name}", note=note,
        ramp_periods=waveform.ramp_periods,
    )  # fmt: skip
    path.write_text(text, encoding="ascii")


def identifier(name: str, language: Literal["C", "MATLAB"] = "C") -> str:
    """The name, if it is a valid variable name; for C, also in a header that C++ includes.

    Raises
    ------
    DesignError
        If it is not valid; the message has the nearest valid one.

    >>> identifier("w_1")
    'w_1'
    >>> identifier("double")
    Traceback (most recent call last):
    ...
    livebode.DesignError: the name 'double' is a keyword or macro of C or C++; ...
    """
    most = LETTERS_MAX[language]
    if name in KEYWORDS[language]:
        whose = "keyword or macro of C or C++" if language == "C" else f"keyword of {language}"
        why, nearest = f"is a {whose}", f"{name}_w"
    elif re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) and "__" not in name and len(name) <= most:
        return name
    else:
        why = f"is not valid in {language} (letters, digits and single underscores, a letter first, at most {most})"
        nearest = _nearest(name, most, KEYWORDS[language])
    facts = {"argument": "name", "name": name, "language": language, "nearest": nearest}
    raise DesignError("name-forbidden", f"the name {name!r} {why}", f"take for example {nearest!r}", **facts)


def _nearest(name: str, most: int, keywords: frozenset[str]) -> str:
    plain = re.sub(r"_+", "_", re.sub(r"[^A-Za-z0-9_]", "_", name)).strip("_")[: most - 2].rstrip("_")
    if not plain:
        return "excitation"
    if not plain[0].isalpha():
        plain = f"w_{plain}"
    return plain if plain not in keywords else f"{plain}_w"


FORMATS: Mapping[str, Callable[[Path, Waveform, str], None]] = {
    ".csv": write_csv,
    ".wav": write_wav,
    ".npz": write_npz,
    ".mat": write_mat,
    ".h": write_c_header,
    ".st": write_st,
}
"""Writers of an excitation, by the suffix of the file. A further format is a function and a row here."""


def write(path: str | PathLike[str], waveform: Waveform, name: str = "excitation") -> None:
    """Write one period in the format of the suffix, whole or not at all.

    Raises
    ------
    UsageError
        If the suffix is not supported.
    DesignError
        If the format forbids the name.
    OSError
        If the file cannot be written; an existing file is unchanged then.
    """
    place = Path(path)
    if place.suffix not in FORMATS:
        raise UsageError(
            "not-one-of",
            f"{place.name!r} does not end in a supported suffix",
            f"choose {', '.join(FORMATS)}",
            argument="out",
            value=place.suffix,
            allowed=list(FORMATS),
        )
    with whole_file(place) as partial:
        FORMATS[place.suffix](partial, waveform, name)
