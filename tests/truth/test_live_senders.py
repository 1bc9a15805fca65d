"""The senders among the examples write what the decoder reads."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from examples.sender import CHANNELS, frames
from livebode.nouns import Channel
from livebode.sources.live import Batch, FrameDecoder, encode_layout, encode_samples

ROOT = Path(__file__).parents[2]
PROGRAM = r"""
#include <stdio.h>
#include "livebode_frame.h"
int main(void) {
    static const char text[] = "w\tN m\ny\t\n";
    const uint32_t layout = lb_frame_crc(0, text, sizeof text - 1);
    float data[10][2];
    uint8_t frame[LB_FRAME_BYTES(sizeof data)];
    for (int i = 0; i < 10; i++) { data[i][0] = (float)i; data[i][1] = (float)-i; }
    fwrite(frame, 1, lb_frame(frame, LB_FRAME_LAYOUT, 0, 5, 0, 0, 4000.0, layout, 2, 0, text, sizeof text - 1), stdout);
    fwrite(frame, 1, lb_frame(frame, LB_FRAME_SAMPLES, 1, 5, 77, 1500000000000000000LL, 4000.0, layout, 2, 10, data,
           sizeof data), stdout);
    return 0;
}
"""


def test_the_c_header_writes_the_same_bytes(tmp_path):
    gcc = shutil.which("gcc")
    if gcc is None:
        pytest.skip("gcc is not installed")
    (tmp_path / "sender.c").write_text(PROGRAM)
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", "-I", ROOT / "examples"]
    subprocess.run([gcc, *strict, tmp_path / "sender.c", "-o", tmp_path / "sender"], check=True)
    written = subprocess.run([tmp_path / "sender"], capture_output=True, check=True).stdout
    channels = (Channel("w", "N m"), Channel("y"))
    data = np.stack([np.arange(10.0), 0.0 - np.arange(10)])
    batch = Batch(77, data, channels, 4000.0, 5, 1.5e9)
    assert written == encode_layout(channels, 4000.0, epoch=5) + encode_samples(batch, sequence=1)


def test_the_simulated_axis_as_a_sender():
    decoder = FrameDecoder()
    batches = [batch for frame in frames(0.5, 9, real_time=False) if (batch := decoder.decode(frame))]
    assert [batch.first_sample for batch in batches] == list(range(0, 2000, 100))
    assert [channel.name for channel in batches[0].channels] == CHANNELS
    assert {batch.epoch for batch in batches} == {9}
