"""`python -m bench.bandwidth`: bandwidth of spectra from a drive, compared with samples of the same signals.

Bytes on the wire: the frames of `examples.sender`, each in a datagram with 28 bytes of UDP and IPv4 headers, including
the layouts. Samples are sent in batches of 25 ms, as float32 like the spectra.
"""

from __future__ import annotations

import numpy as np

from examples.sender import CHANNELS, frames, layout, spectra_frames
from livebode import Lines

SECONDS = 10.0
HEADERS = 28
TARGETS = {20: 1 / 4, 2: 1 / 40}
LINES = {"7 lines": "20:140:20", "21 lines": "20:420:20"}
FEW = 8
"""Largest number of quiet bins for 21 lines within the target; the noise of a line is from the nearest four."""


def bytes_per_s(made: list[bytes]) -> float:
    return sum(len(frame) + HEADERS for frame in made) / SECONDS


def measure() -> list[tuple[str, int, float, float]]:
    """Content, spectra per second, bytes per second of the samples and of the spectra."""
    samples = bytes_per_s(list(frames(SECONDS, 1, real_time=False)))
    found = []
    for name, text in LINES.items():
        lines = Lines.parse(text, rate_hz=4000, window=400)
        for many in sorted({0, min(FEW, len(lines.quiet)), len(lines.quiet)}):
            quiet = tuple(lines.quiet[int(i)] for i in np.linspace(0, len(lines.quiet) - 1, many))
            sent = Lines(lines.bins, lines.window, lines.rate_hz, quiet)
            for per_second in TARGETS:
                made = list(spectra_frames(SECONDS, 1, layout(per_second, sent), lines, real_time=False))
                found.append((f"{name}, {many} quiet bins", per_second, samples, bytes_per_s(made)))
    return found


def main() -> None:
    print(f"{len(CHANNELS)} channels at 4 kHz; spectra of three of them, and the value of the fourth\n")
    print(f"{'content':28} {'spectra/s':>9} {'samples B/s':>12} {'spectra B/s':>12} {'ratio':>7} {'target':>7}")
    for what, per_second, samples, spectra in measure():
        target = TARGETS[per_second]
        verdict = "" if spectra <= target * samples else "  missed"
        print(
            f"{what:28} {per_second:9} {samples:12.0f} {spectra:12.0f} {'1/' + format(samples / spectra, '.1f'):>7} "
            f"{'1/' + format(1 / target, '.0f'):>7}{verdict}"
        )


if __name__ == "__main__":
    main()
