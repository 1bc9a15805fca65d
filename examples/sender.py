"""A machine that sends: the simulated belt axis over UDP, for a first try without a drive (docs/how-to/live.md).

python -m examples.sender 127.0.0.1:5000
python -m examples.sender 127.0.0.1:5000 --spectra 20

The second is a drive that runs the kernel and sends 20 spectra a second instead of samples.
"""

from __future__ import annotations

import argparse
import secrets
import socket
import time
from collections.abc import Iterator

import numpy as np

from livebode import Channel, Lines, multisine
from livebode.core import LivebodeError, SpectraLayout
from livebode.simulation import BeltAxis, SimulatedAxis, Strokes
from livebode.sources.live import (
    Batch,
    encode_layout,
    encode_samples,
    encode_spectra,
    encode_spectra_layout,
)
from livebode.sources.live.kernel_drive import KernelDrive

BATCH = 100
CHANNELS = ["w", "u", "velocity", "x"]
LAYOUT_EVERY_S = 5
LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)


def axis(seconds: float, lines: Lines = LINES) -> SimulatedAxis:
    motion = Strokes(start_m=0.25, end_m=1.6, speed_m_per_s=0.38)
    return SimulatedAxis(BeltAxis(motion=motion, excitation_n_m=multisine(lines), seconds=seconds))


def frames(seconds: float, epoch: int, real_time: bool = True) -> Iterator[bytes]:
    """Frames as a drive would send them: the layout first and once a second, batches of 25 ms at their time."""
    began = time.time()
    for sequence, block in enumerate(axis(seconds).blocks(CHANNELS, BATCH, real_time=real_time)):
        if block.start % 4000 == 0:
            yield encode_layout(block.channels, block.rate_hz, epoch=epoch, sequence=sequence)
        stamp_s = began + block.start / block.rate_hz
        batch = Batch(block.start, np.array(block.data), block.channels, block.rate_hz, epoch, stamp_s)
        yield encode_samples(batch, sequence=sequence)


def layout(per_second: float, lines: Lines = LINES) -> SpectraLayout:
    """So many spectra a second of w, u and the velocity, with the cart's position beside; quiet bins for the noise."""
    signals = (Channel("w", "N m"), Channel("u", "N m"), Channel("velocity", "rad/s"))
    hop = round(lines.rate_hz / per_second)
    return SpectraLayout(signals, (Channel("x", "m"),), lines.window, hop, lines.bins, lines.quiet)


def spectra_frames(
    seconds: float, epoch: int, what: SpectraLayout, lines: Lines = LINES, real_time: bool = True
) -> Iterator[bytes]:
    """Frames of a drive that runs the kernel: the layout first and every 5 s, each spectrum at its time."""
    blocks = axis(seconds, lines).blocks(CHANNELS, BATCH, real_time=real_time)
    due = 0
    for sequence, batch in enumerate(KernelDrive(what).spectra(blocks, epoch)):
        if batch.stop > due:
            yield encode_spectra_layout(what, batch.rate_hz, epoch=epoch, sequence=sequence)
            due += round(LAYOUT_EVERY_S * batch.rate_hz)
        yield encode_spectra(batch, sequence=sequence)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", metavar="HOST:PORT")
    parser.add_argument("--spectra", metavar="N", type=float, help="send N spectra a second instead of samples")
    parser.add_argument("--seconds", type=float, default=60.0)
    options = parser.parse_args()
    host, _, port = options.target.rpartition(":")
    epoch = secrets.randbits(63)
    if options.spectra is not None and not options.spectra > 0:
        parser.error(f"--spectra {options.spectra:g} is not above 0; 20 a second is usual")
    try:
        if options.spectra is None:
            made = frames(options.seconds, epoch)
        else:
            made = spectra_frames(options.seconds, epoch, layout(options.spectra))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for frame in made:
                sender.sendto(frame, (host, int(port)))
    except LivebodeError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
