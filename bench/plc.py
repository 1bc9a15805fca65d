"""Cost of the generated function blocks on a PLC: LREAL operations per sample, counted at run time, and memory.

`python -m bench.plc` prints the tables of wings/drives/docs/plc.md. An operation is +, -, *, /, ABS, a comparison or a
sign change of LREAL numbers.
"""

from __future__ import annotations

import argparse

import numpy as np

from livebode.core import Lines
from livebode.excitation import function_block, multisine, schroeder_phases
from livebode.kernel import SlidingDFT
from livebode_drives.structured_text.sliding_dft import sliding_dft
from tests.twins.sliding import TwinDFT
from tools.structured_text import Instance, Machine
from tools.structured_text.types import Array, Scalar

WINDOW, RATE_HZ = 400, 4000.0


def memory_bytes(block: Instance) -> int:
    """Memory of all its variables."""
    size = {"LREAL": 8, "ULINT": 8, "UDINT": 4, "BOOL": 1}
    kinds = block._unit.kinds.values()
    arrays = sum(size[k.of.name] * int(np.prod(k.lengths)) for k in kinds if isinstance(k, Array))
    return arrays + sum(size[k.name] for k in kinds if isinstance(k, Scalar))


def spectra(bins: int, channels: int, phase: str) -> str:
    """A row of the table of FB_SlidingDft; its outputs over ten periods are compared with the kernel's."""
    names = ["w", "u", "y"][:channels]
    lines = Lines(tuple(range(1, bins + 1)), WINDOW, RATE_HZ)
    block = Machine(sliding_dft(lines, names, phase=phase)).instance("FB_SlidingDft")
    filling = max(block() for _ in range(WINDOW))
    x = np.random.default_rng(0).standard_normal((channels, 10 * WINDOW))
    expected = SlidingDFT(WINDOW, list(lines.bins), channels=channels).process(x, phase=phase)
    counts, error = [], 0.0
    for n, sample in enumerate(x.T.tolist()):
        counts.append(block(**dict(zip(names, sample))))
        error = max(error, np.max(np.abs(block["re"] + 1j * block["im"] - expected[:, n])))
    return (
        f"| {bins} | {channels} | {phase} | {np.mean(counts):.1f} | {max(counts)} | {filling} "
        f"| {memory_bytes(block)} | {error:g} |"
    )


def longer_registers(bins: int) -> str:
    """Largest difference of the recursion in long double from the kernel over ten windows, in units of √N·‖x‖₂."""
    x = np.random.default_rng(0).standard_normal(10 * WINDOW)
    places = list(range(1, bins + 1))
    longer = TwinDFT(WINDOW, places, dtype=np.longdouble).process(x[None], phase="fixed")[0]
    kernel = SlidingDFT(WINDOW, places).process(x, phase="fixed")
    norms = np.sqrt(np.convolve(x**2, np.ones(WINDOW))[: len(x)])
    return f"K = {bins}: {np.max(np.abs(longer - kernel).max(axis=1) / norms) / np.sqrt(WINDOW):.1e}"


def sum_of_lines(lines: Lines, amplitude: float) -> str:
    """The alternative multisine: sum of cos and sin of each line, from a table of one turn."""
    window, phases = lines.window, schroeder_phases(len(lines))
    start = "".join(
        f"bins[{i}] := {k};\nb[{i}] := {amplitude * np.cos(p):.17f};\na[{i}] := {amplitude * np.sin(p):.17f};\n"
        for i, (k, p) in enumerate(zip(lines.bins, phases))
    )
    last = len(lines) - 1
    return f"""FUNCTION_BLOCK FB_Sum
VAR_OUTPUT w : LREAL; END_VAR
VAR
    a, b : ARRAY [0..{last}] OF LREAL; bins, place : ARRAY [0..{last}] OF UDINT;
    cosine, sine : ARRAY [0..{window - 1}] OF LREAL; started : BOOL; i : UDINT;
END_VAR
IF NOT started THEN
{start}started := TRUE;
END_IF
w := 0.0;
FOR i := 0 TO {last} DO
    w := w + a[i] * cosine[place[i]] + b[i] * sine[place[i]];
    place[i] := place[i] + bins[i];
    IF place[i] >= {window} THEN
        place[i] := place[i] - {window};
    END_IF
END_FOR
END_FUNCTION_BLOCK
"""


def excitation(count: int) -> str:
    """A row of the table of FB_Multisine: one period in a table, compared with the sum of its lines."""
    window = 100
    lines = Lines(tuple(range(1, count + 1)), window, RATE_HZ)
    period = multisine(lines, 0.1)
    played = Machine(function_block(period, rate_hz=RATE_HZ, limit=9.0)).instance("FB_Multisine")
    for _ in range(2 * window):
        ramp = played(enable=True)
    summed = Machine(sum_of_lines(lines, 0.1)).instance("FB_Sum")
    angle = 2 * np.pi * np.arange(window) / window
    summed.memory.v_cosine[:], summed.memory.v_sine[:] = np.cos(angle).tolist(), np.sin(angle).tolist()
    errors = []
    for block in (played, summed):
        found = []
        for _ in range(window):
            operations = block()
            found.append(block["w"])
        errors.append((operations, float(np.max(np.abs(np.array(found) - period)))))
    (table, table_error), (sums, sum_error) = errors
    return f"| {count} | {table} | {ramp} | {table_error:g} | {sums} | {sum_error:.1e} |"


def main() -> None:
    """Print the tables."""
    argparse.ArgumentParser(prog="python -m bench.plc", description=__doc__).parse_args()
    print(f"FB_SlidingDft, N = {WINDOW}\n")
    print("| K | channels | phase | mean | max | while the table fills | bytes | difference from the kernel |")
    print("|---|---|---|---|---|---|---|---|")
    for bins in (7, 21):
        for channels, phase in ((2, "fixed"), (3, "fixed"), (2, "window")):
            print(spectra(bins, channels, phase))
    print(f"\nDifference of sums with a mantissa of {np.finfo(np.longdouble).nmant + 1} bits, over sqrt(N)*|x|")
    print(", ".join(longer_registers(bins) for bins in (7, 21)))
    print("\nFB_Multisine compared with a sum of its lines\n")
    print("| K | table | in a ramp | difference from the period | sum of lines | difference from the period |")
    print("|---|---|---|---|---|---|")
    for count in (7, 21):
        print(excitation(count))


if __name__ == "__main__":
    main()
