"""The senders among the examples write what the decoder reads."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bench.bandwidth import TARGETS, measure
from examples.sender import CHANNELS, frames, layout, spectra_frames
from livebode.core import Channel, SpectraLayout
from livebode.sources.live import (
    Batch,
    FrameDecoder,
    SpectraBatch,
    encode_layout,
    encode_samples,
    encode_spectra,
    encode_spectra_layout,
)
from livebode.sources.live.framing import FRAME_BYTES_MIN
from livebode.sources.live.spectra_frame import spectra_text

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
SPECTRA_PROGRAM = r"""
#include <stdio.h>
#include "livebode_frame.h"
int main(void) {
    static const char text[] =
        "window\t400\nhop\t20\nlines\t2 4\nquiet\t3\n"
        "signal\tw\tN m\t0\nsignal\tq\trad\t0.5\tdifferenced\nvalue\tx\tm\n";
    const uint32_t layout = lb_frame_crc(0, text, sizeof text - 1);
    static uint8_t frame[LB_FRAME_BYTES(LB_FRAME_SPECTRA_PAYLOAD(2, 3, 1, 2))];
    float sums[2][3][2], x;
    fwrite(frame, 1, lb_frame(frame, LB_FRAME_SPECTRA_LAYOUT, 0, 5, 0, 0, 4000.0, layout, 3, 0, text, sizeof text - 1),
           stdout);
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 12; k++) { (&sums[0][0][0])[k] = (float)(k + 100 * i) + 0.1f; }
        x = 0.3f + (float)i;
        const uint32_t state = i ? LB_FRAME_NOT_WHOLE | LB_FRAME_SPIKE : 0;
        lb_frame_put_spectrum(frame, (uint16_t)i, state, &x, 1, &sums[0][0][0], 2, 3);
    }
    fwrite(frame, 1, lb_frame_spectra(frame, 1, 5, 419, 1500000000000000000LL, 4000.0, layout, 2, 3, 1, 2), stdout);
    return 0;
}
"""


def written_by(program: str, folder: Path) -> bytes:
    """What this C program, compiled strictly, writes to its standard output."""
    gcc = shutil.which("gcc")
    if gcc is None:
        pytest.skip("gcc is not installed")
    (folder / "sender.c").write_text(program)
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", "-I", ROOT / "examples"]
    subprocess.run([gcc, *strict, folder / "sender.c", "-o", folder / "sender"], check=True)
    return subprocess.run([folder / "sender"], capture_output=True, check=True).stdout


def test_the_c_header_writes_the_same_spectra(tmp_path):
    written = written_by(SPECTRA_PROGRAM, tmp_path)
    layout = SpectraLayout(
        (Channel("w", "N m"), Channel("q", "rad")),
        (Channel("x", "m"),),
        window=400,
        hop=20,
        lines=(2, 4),
        quiet=(3,),
        subtracted=(0.0, 0.5),
        differenced=(False, True),
    )
    pairs = np.float32(np.arange(12).reshape(2, 3, 2)) + np.float32(0.1)
    rows = np.stack([pairs, np.float32(np.arange(100, 112).reshape(2, 3, 2)) + np.float32(0.1)], axis=1)
    sums = rows[..., 0].astype(float) + 1j * rows[..., 1]
    values = np.float64(np.array([[0.3, 1.3]], dtype=np.float32))
    stamp_s = 1.5e9 - 19 / 4000
    batch = SpectraBatch(400, sums, values, np.array([0, 3], np.uint32), layout, 4000.0, 5, stamp_s)
    split = FRAME_BYTES_MIN + len(spectra_text(layout))
    assert written[:split] == encode_spectra_layout(layout, 4000.0, epoch=5)
    decoder = FrameDecoder()
    assert decoder.decode(written[:split]) is None
    found = decoder.decode(written[split:])
    assert (found.first_sample, found.stop, found.layout, found.rate_hz, found.epoch) == (400, 440, layout, 4000.0, 5)
    assert found.stamp_s == pytest.approx(stamp_s, abs=1e-6)
    np.testing.assert_array_equal(found.sums, sums)
    np.testing.assert_array_equal(found.values, values)
    np.testing.assert_array_equal(found.state, [0, 3])
    again = encode_spectra(batch, sequence=1)
    assert written[split:][:32] == again[:32]  # the stamp behind them is a float's rounding away
    assert written[split:][40:-4] == again[40:-4]


def test_the_c_header_writes_the_same_bytes(tmp_path):
    written = written_by(PROGRAM, tmp_path)
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


def test_the_simulated_axis_as_a_drive_that_runs_the_kernel():
    decoder = FrameDecoder()
    what = layout(20)
    batches = [batch for f in spectra_frames(2.2, 9, what, real_time=False) if (batch := decoder.decode(f))]
    assert [batch.first_sample for batch in batches] == list(range(0, 8800, 200))
    assert {batch.layout for batch in batches} == {what}
    assert [int(batch.state[0]) for batch in batches[:3]] == [1, 0, 0]


def test_spectra_need_a_fraction_of_the_bandwidth_of_samples():
    found = {(what, per_second): spectra / samples for what, per_second, samples, spectra in measure()}
    for (what, per_second), share in found.items():
        if what != "21 lines, 20 quiet bins":  # which are as much again
            assert share <= TARGETS[per_second], (what, per_second)
