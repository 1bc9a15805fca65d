"""WAV: every sample format as SciPy reads it, the rate of the header, and headers that declare too much."""

from __future__ import annotations

import io
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
import scipy
from scipy.io import wavfile

from livebode.core import RecordingError
from livebode.sources import open_log
from tests.support.errors import refused

SCIPY_FILES = sorted((Path(scipy.__file__).parent / "io" / "tests" / "data").glob("*.wav"))
UNREADABLE = "early-eof", "incomplete-chunk", "ulaw", "inconsistent"


def samples_of(path: Path) -> np.ndarray:
    return np.concatenate([block.data for block in open_log(path).blocks(block_samples=7)], axis=1)


@pytest.mark.parametrize("path", SCIPY_FILES, ids=lambda path: path.stem)
def test_the_sample_files_of_scipy_give_its_values_or_are_refused(path):
    if any(word in path.stem for word in UNREADABLE):
        with pytest.raises(RecordingError, match=r"wav"):
            open_log(path)
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rate_hz, expected = wavfile.read(path)
    assert (open_log(path).rate_hz, open_log(path).rate_origin) == (rate_hz, "metadata")
    np.testing.assert_array_equal(samples_of(path), expected.reshape(len(expected), -1).T)


@pytest.mark.parametrize("dtype", ["u1", "i2", "i4", "f4", "f8"])
def test_channels_are_numbered_and_values_are_those_in_the_file(tmp_path, dtype):
    values = (np.random.default_rng(0).standard_normal((500, 3)) * 40 + 100).astype(dtype)
    wavfile.write(tmp_path / "a.wav", 48000, values)
    assert [channel.name for channel in open_log(tmp_path / "a.wav").channels] == ["c1", "c2", "c3"]
    np.testing.assert_array_equal(samples_of(tmp_path / "a.wav"), values.T)


def test_a_file_written_as_a_stream_ends_where_the_bytes_end(tmp_path):
    """Programs that write into a pipe leave all sizes at their maximum."""
    memory = io.BytesIO()
    wavfile.write(memory, 8000, np.arange(100, dtype=np.int16))
    raw = bytearray(memory.getvalue())
    raw[4:8] = raw[40:44] = b"\xff\xff\xff\xff"
    (tmp_path / "a.wav").write_bytes(raw)
    np.testing.assert_array_equal(samples_of(tmp_path / "a.wav"), [np.arange(100)])


def header(channels: int, rate_hz: int, frame_bytes: int, samples: bytes) -> bytes:
    fmt = struct.pack("<HHIIHH", 1, channels, rate_hz, rate_hz * frame_bytes, frame_bytes, 16)
    body = b"WAVEfmt " + struct.pack("<I", 16) + fmt + b"data" + struct.pack("<I", len(samples)) + samples
    return b"RIFF" + struct.pack("<I", len(body)) + body


@pytest.mark.parametrize(
    ("content", "code", "facts"),
    [
        (header(1, 0, 2, bytes(20)), "damaged", {}),
        (header(0, 8000, 2, bytes(20)), "damaged", {"channels": 0}),
        (header(30_000, 8000, 60_000, bytes(120_000)), "too-large", {"limit": 20_000}),
        (header(2, 8000, 4, bytes(21)), "damaged", {"size": 21}),
        (header(2, 8000, 4, bytes(20))[:-3], "truncated", {"missing_bytes": 3}),
        (b"RIFF\0\0\0\0WAVE" + b"JUNK\0\0\0\0" * 20_000, "too-large", {"limit": 10_000}),
        (b"RIFF\0\0\0\0WAVEfmt \xff\xff\xff\x7f" + bytes(30), "damaged", {"size": 0x7FFFFFFF}),
        (b"RIFF\0\0\0\0WAVEdata\x04\0\0\0" + bytes(30), "damaged", {}),
    ],
)
def test_headers_that_contradict_their_file_are_refused(tmp_path, content, code, facts):
    path = tmp_path / "a.wav"
    path.write_bytes(content)
    with refused(RecordingError, code, path=str(path), **facts):
        open_log(path)
