"""A machine that sends: the simulated belt axis over UDP, for a first try without a drive (docs/live.md).

python examples/sender.py 127.0.0.1:5000
"""

from __future__ import annotations

import secrets
import socket
import sys
import time
from collections.abc import Iterator

import numpy as np

from livebode import Lines, multisine
from livebode.simulation import BeltAxis, SimulatedAxis, Strokes
from livebode.sources.live import Batch, encode_layout, encode_samples

BATCH = 100
CHANNELS = ["w", "u", "velocity", "x"]


def frames(seconds: float, epoch: int, real_time: bool = True) -> Iterator[bytes]:
    """Frames as a drive would send them: the layout first and once a second, batches of 25 ms at their time."""
    lines = Lines.parse("20:140:20", rate_hz=4000, window=400)
    motion = Strokes(start_m=0.25, end_m=1.6, speed_m_per_s=0.38)
    axis = SimulatedAxis(BeltAxis(motion=motion, excitation_n_m=multisine(lines), seconds=seconds))
    began = time.time()
    for sequence, block in enumerate(axis.blocks(CHANNELS, BATCH, real_time=real_time)):
        if block.start % 4000 == 0:
            yield encode_layout(block.channels, block.rate_hz, epoch=epoch, sequence=sequence)
        stamp_s = began + block.start / block.rate_hz
        batch = Batch(block.start, np.array(block.data), block.channels, block.rate_hz, epoch, stamp_s)
        yield encode_samples(batch, sequence=sequence)


def main() -> None:
    host, _, port = sys.argv[1].rpartition(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for frame in frames(60.0, secrets.randbits(63)):
            sender.sendto(frame, (host, int(port)))


if __name__ == "__main__":
    main()
