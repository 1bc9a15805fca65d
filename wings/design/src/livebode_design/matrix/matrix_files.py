"""Excitations of several inputs as files: a column or a row of the table for each input, over all experiments."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from livebode.version import __version__
from livebode_design.files import as_lines, c_rows, identifier, write_struct
from livebode_design.matrix.result import MatrixDesign


def facts(design: MatrixDesign) -> dict[str, Any]:
    """What reproduces the excitation, as plain data."""
    used, lines = design.excitation, design.excitation.lines
    return {
        "made_by": f"livebode {__version__} design",
        "kind": used.kind,
        "seed": design.spec.seed,
        "rate_hz": lines.rate_hz,
        "window": lines.window,
        "bins": list(lines.bins),
        "unit": "N m",
        "experiments": len(used.spectra),
        "dwell_periods": used.dwell,
        "settle_periods": used.settle,
        "repetitions": design.repetitions,
        "peak": np.abs(used.samples).max(axis=1).tolist(),
    }


def write_csv(path: Path, design: MatrixDesign, name: str) -> None:
    """Columns time and one for each excitation; `open_log` reads it as a recording. The name is not in it."""
    rate_hz = design.excitation.lines.rate_hz
    columns = ",".join(f"{word} [N m]" for word in design.excitations)
    rows = (
        ",".join([repr(n / rate_hz), *map(repr, values)])
        for n, values in enumerate(design.excitation.samples.T.tolist())
    )
    head = [f"# {line}" for line in as_lines(facts(design) | {"name": name})]
    path.write_text("\n".join([*head, f"time [s],{columns}", *rows]) + "\n", encoding="utf-8")


def _arrays(design: MatrixDesign) -> dict[str, Any]:
    used = design.excitation
    return {
        "samples": used.samples,
        "frequency_hz": used.lines.frequency_hz,
        "spectra": used.spectra,
        "sigma": design.sigma,
        "rate_hz": used.lines.rate_hz,
        "facts": json.dumps(facts(design)),
    }


def write_npz(path: Path, design: MatrixDesign, name: str) -> None:
    """Arrays `samples` (inputs, samples), `spectra` (experiments, inputs, lines), `sigma` (lines, outputs, inputs)."""
    with path.open("wb") as file:  # NumPy adds a suffix to a path
        np.savez(file, name=name, **_arrays(design))


def write_mat(path: Path, design: MatrixDesign, name: str) -> None:
    """A MATLAB v5 file with one struct of that name; `samples` has a column for each input, `Ts` is in seconds."""
    arrays = _arrays(design)
    struct = arrays | {
        "samples": arrays["samples"].T,
        "frequency_hz": arrays["frequency_hz"][:, np.newaxis],
        "Ts": 1 / design.excitation.lines.rate_hz,
    }
    write_struct(path, struct, name)


def write_c_header(path: Path, design: MatrixDesign, name: str) -> None:
    """``name[NAME_INPUTS][NAME_SAMPLES]`` in N m, all experiments; values in hexadecimal, so exactly the doubles."""
    word = identifier(name)
    big, used = word.upper(), design.excitation
    comment = "\n".join(f" * {line}".replace("*/", "* /") for line in as_lines(facts(design)))
    tables = ",\n".join("{\n" + c_rows([value.hex() for value in row]) + "\n}" for row in used.samples.tolist())
    text = f"""/* Excitations of several motors over all experiments, N m; play them repeatedly.
{comment}
 */
#ifndef {big}_H
#define {big}_H

#ifndef {big}_TYPE
#define {big}_TYPE double
#endif

#define {big}_INPUTS {len(used.samples)}
#define {big}_SAMPLES {used.samples.shape[1]}
#define {big}_WINDOW {used.lines.window}
#define {big}_LINES {len(used.lines)}
#define {big}_RATE_HZ {used.lines.rate_hz!r}

static const {big}_TYPE {word}[{big}_INPUTS][{big}_SAMPLES] = {{
{tables}
}};

static const unsigned {word}_bins[{big}_LINES] = {{
{c_rows([f"{k}u" for k in used.lines.bins])}
}};

#endif
"""
    path.write_text(text, encoding="ascii")


MATRIX_FORMATS: Mapping[str, Callable[[Path, MatrixDesign, str], None]] = {
    ".csv": write_csv,
    ".npz": write_npz,
    ".mat": write_mat,
    ".h": write_c_header,
}
"""Writers by suffix. The program for a PLC (.st) plays one excitation only."""
