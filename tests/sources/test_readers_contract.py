"""What every reader must hold. A new format needs a line in a table and a writer in
tests/support/recordings.py; all of this then covers it."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from livebode.core import RecordingError
from livebode.sources.formats import all_formats
from tests.support.errors import refused
from tests.support.recordings import CLOCKS, OWN_RATE, RATE_HZ, WRITERS, names, open_log, signals, with_time, write

MODULES = sorted(WRITERS)
TIMED = [module for module in MODULES if module not in OWN_RATE]


def read(module: str, path: Path, **options: object) -> dict[str, np.ndarray]:
    blocks = list(open_log(path, **options).blocks(names(module)))
    return {
        name: np.concatenate([block[own] for block in blocks])
        for name, own in zip(("input", "output"), names(module), strict=True)
    }


def test_every_format_has_a_writer():
    modules = {format_.reader.partition(":")[0].rpartition(".")[2] for format_ in all_formats()}
    assert modules | {"matlab73"} == WRITERS.keys()  # a MATLAB file of version 7.3 is one of HDF5, read by its module


@pytest.mark.parametrize("module", MODULES)
def test_the_same_signals_come_back_bit_for_bit(module, tmp_path):
    truth = signals()
    got = read(module, write(module, tmp_path, truth), rate_hz=RATE_HZ)
    for name, values in truth.items():
        np.testing.assert_array_equal(got[name], values)


@pytest.mark.parametrize("module", TIMED)
def test_the_rate_comes_from_the_time_column(module, tmp_path):
    log = open_log(write(module, tmp_path, with_time(signals())))
    assert log.rate_hz == RATE_HZ
    clock = CLOCKS.get(module, "t")
    assert repr(clock) in log.rate_origin
    assert log.timing.gaps == 0
    assert log.samples == 1000
    assert [channel.name for channel in log.channels if channel.name != clock] == list(names(module))


@pytest.mark.parametrize("module", TIMED)
def test_a_gap_is_counted_and_marked(module, tmp_path):
    truth = with_time(signals(1003))
    kept = np.delete(np.arange(1003), [400, 401, 402])
    log = open_log(write(module, tmp_path, {name: values[kept] for name, values in truth.items()}))
    assert (log.timing.gaps, log.timing.missing, log.timing.first_gaps[0].sample) == (1, 3, 403)
    (output,) = names(module)[1:]
    blocks = list(log.blocks([output]))
    assert [block.start for block in blocks if block.gap] == [403]
    for block in blocks:
        np.testing.assert_array_equal(block[output], truth["output"][block.start : block.stop])
        np.testing.assert_allclose(block.time_s, truth["t"][block.start : block.stop], rtol=1e-12)


@pytest.mark.parametrize("module", MODULES)
@pytest.mark.parametrize("block_samples", [1, 7, 500, 1 << 20])
def test_any_block_size_gives_the_same_samples(module, block_samples, tmp_path):
    truth = signals(600)
    log = open_log(write(module, tmp_path, truth), rate_hz=RATE_HZ, block_samples=block_samples)
    input_, output = names(module)
    blocks = list(log.blocks([output, input_]))
    assert max(len(block) for block in blocks) <= block_samples
    assert blocks[0].names == (output, input_)
    assert all(a.stop == b.start for a, b in pairwise(blocks))
    np.testing.assert_array_equal(np.concatenate([block[input_] for block in blocks]), truth["input"])


@pytest.mark.parametrize("module", MODULES)
def test_content_decides_not_the_ending(module, tmp_path):
    path = write(module, tmp_path, signals())
    got = read(module, path.rename(tmp_path / "recording.unknown"), rate_hz=RATE_HZ)
    np.testing.assert_array_equal(got["input"], signals()["input"])


@pytest.mark.parametrize("module", TIMED)
def test_samples_that_are_no_numbers_stay_that(module, tmp_path):
    truth = signals(50)
    truth["input"][[3, 10]] = np.nan, np.inf
    got = read(module, write(module, tmp_path, truth), rate_hz=RATE_HZ)
    np.testing.assert_array_equal(got["input"], truth["input"])


@pytest.mark.parametrize("module", MODULES)
def test_a_misspelt_channel_names_the_nearest(module, tmp_path):
    log = open_log(write(module, tmp_path, signals()), rate_hz=RATE_HZ)
    *_, last = name = names(module)[0]
    with pytest.raises(RecordingError) as caught:
        log.blocks([name + last])
    assert (caught.value.code, caught.value.channel) == ("recording.channel-unknown", name + last)
    assert caught.value.remedy.startswith(f"did you mean {name!r}?")


@pytest.mark.parametrize("module", [module for module in TIMED if module not in (*CLOCKS, "lvm")])
def test_a_recording_without_time_and_rate_is_refused(module, tmp_path):
    path = write(module, tmp_path, signals())
    with refused(RecordingError, "rate-missing", argument="rate_hz", path=str(path)):
        open_log(path)


@pytest.mark.parametrize("module", MODULES)
def test_a_rate_that_contradicts_the_file_is_refused(module, tmp_path):
    path = write(module, tmp_path, with_time(signals()))
    with refused(RecordingError, "rate-conflict", argument="rate_hz", rate_hz=4000.0, given_hz=4100):
        open_log(path, rate_hz=4100)


@pytest.mark.parametrize("module", TIMED)
def test_time_none_ignores_the_time_column(module, tmp_path):
    log = open_log(write(module, tmp_path, with_time(signals())), rate_hz=4100, time="none")
    assert (log.rate_hz, log.rate_origin, log.timing) == (4100, "given", None)


@pytest.mark.parametrize("module", TIMED)
def test_time_that_goes_back_names_the_sample(module, tmp_path):
    given = with_time(signals())
    given["t"][700] = given["t"][698]
    path = write(module, tmp_path, given)
    unit = {"codesys": 1e3, "mcap": 1e9, "rosbag": 1e9, "svdx": 1e9, "twincat": 1e3}.get(
        module, 1
    )  # ns where time is UTC
    times = [round(0.17475 * unit, 9), round(0.1745 * unit, 9)]
    with refused(RecordingError, "time-not-increasing", sample=700, times=times):
        open_log(path)


@pytest.mark.parametrize("module", MODULES)
def test_blocks_read_from_the_start_each_time(module, tmp_path):
    log = open_log(write(module, tmp_path, signals()), rate_hz=RATE_HZ)
    first = next(iter(log.blocks(names(module)[:1], block_samples=10)))
    again = next(iter(log.blocks(names(module)[:1], block_samples=10)))
    np.testing.assert_array_equal(first.data, again.data)
    assert not first.data.flags.writeable
