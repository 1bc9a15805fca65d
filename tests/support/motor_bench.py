"""A recording of a motor bench with a multisine, 20 periods, and its responses."""

from __future__ import annotations

from functools import cache

import numpy as np

from livebode.core import Block, Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.sources import open_log
from tests.support.real_recordings import recording

BENCH = Lines.parse("11:250:1", rate_hz=2500, window=2500)
BENCH_CHANNELS = ("iq_refx", "iq_adx", "theta_mx")


def whole(path: str, channels: tuple[str, ...], **options: object) -> Block:
    """All samples of some channels as one Block."""
    blocks = list(open_log(recording(path), **options).blocks(channels))
    return Block(np.concatenate([b.data for b in blocks], axis=1), blocks[0].channels, blocks[0].rate_hz)


@cache
def motorbench() -> Block:
    return whole("motorbench/MultisineTypeA.mat", BENCH_CHANNELS)


def bench_responses(block: Block, **options: object) -> Responses:
    names = {"excitation": "iq_refx", "input": "iq_adx", "output": "theta_mx", "lines": BENCH, "hop": 2500}
    return Tracker(Settings(**(names | options))).process(block)
