"""Starts, gaps, samples that are not finite, spikes and wrong input: what is not whole is never shown as valid."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Block, Lines, LivebodeError, Loop, SignalError, UsageError
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.kernel import instruction_sets
from tests.support.errors import refused
from tests.support.found import with_events

WINDOW, RATE_HZ = 100, 1000.0
LINES = Lines.parse("50,100,200", RATE_HZ, WINDOW)
NAMES = ("w", "u", "y")


def record(samples: int = 1000, start: int = 0) -> Block:
    w = np.resize(multisine(LINES), samples)
    return Block(np.array([w, w, 2 * w]), NAMES, RATE_HZ, start=start)


def tracker(**options: object) -> Tracker:
    return Tracker(Settings(**({"lines": LINES, "output": "y", "input": "u", "excitation": "w", "hop": 1} | options)))


def changed(block: Block, channel: str, at: int, value: float) -> Block:
    data = block.data.copy()
    data[block.index(channel), at] = value
    return Block(data, block.channels, block.rate_hz, block.start)


@pytest.mark.parametrize("start", [0, 37])
def test_nothing_is_valid_before_a_whole_window(start: int) -> None:
    responses = tracker().process(record(300, start))
    assert np.array_equal(responses.valid.all(axis=1), np.arange(300) >= WINDOW - 1)
    assert np.isnan(responses.value[: WINDOW - 1]).all()
    assert np.allclose(responses.value[WINDOW - 1 :], 2)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("channel", NAMES)
def test_a_sample_that_is_not_finite_is_gone_after_one_window(value: float, channel: str) -> None:
    found = tracker()
    responses, events = with_events(found.process, changed(record(), channel, 333, value))
    n = np.arange(1000)
    assert np.array_equal(responses.valid.all(axis=1), (n >= 99) & ((n < 333) | (n >= 333 + WINDOW)))
    assert np.allclose(responses.value[responses.valid], 2)
    assert [(e.kind, e.sample, e.time_s) for e in events] == [("non-finite", 333, 0.333)]
    assert found.counts["non-finite"] == 1


def test_a_sample_too_large_for_float32_is_missing_there() -> None:
    found = tracker(dtype="float32")
    responses = found.process(changed(record(), "y", 333, 1e39))
    n = np.arange(1000)
    assert np.array_equal(responses.valid.all(axis=1), (n >= 99) & ((n < 333) | (n >= 333 + WINDOW)))
    assert np.allclose(responses.value[responses.valid], 2, rtol=1e-5)
    assert found.counts["non-finite"] == 1


@pytest.mark.parametrize("size", [1e10, 1e30, 1e300])
@pytest.mark.parametrize("hop", [1, 7, 100])
def test_a_giant_sample_is_gone_after_one_window(size: float, hop: int) -> None:
    # The sums of the kernel remember it until they are renewed, up to a window longer.
    found = tracker(hop=hop)
    responses, events = with_events(found.process, changed(record(), "y", 333, size))
    whole = (responses.sample >= 99) & ((responses.sample < 333) | (responses.sample >= 333 + WINDOW))
    assert np.array_equal(responses.valid.all(axis=1), whole)
    assert np.allclose(responses.value[whole], 2, rtol=1e-9)
    assert [(e.kind, e.sample) for e in events] == [("implausible", 333)]


@pytest.mark.parametrize("missing", [1, 50, 12345])
def test_a_gap_is_gone_after_one_window(missing: int) -> None:
    found, block = tracker(), record()
    found.process(block.cut(0, 450))
    rest = block.cut(450, 1000)
    later = Block(rest.data, rest.channels, rest.rate_hz, start=450 + missing)
    responses, (event, *_) = with_events(found.process, later)
    assert np.array_equal(responses.valid.all(axis=1), np.arange(550) >= WINDOW - 1)
    assert np.allclose(responses.value[responses.valid], 2)
    assert (event.kind, event.sample, event.details["missing_samples"]) == ("gap", 450 + missing, missing)


def test_a_flagged_gap_without_missing_numbers_counts_too() -> None:
    found, block = tracker(), record()
    found.process(block.cut(0, 400))
    rest = block.cut(400, 1000)
    responses = found.process(Block(rest.data, rest.channels, RATE_HZ, start=400, gap=True))
    assert not responses.valid[: WINDOW - 1].any()
    assert found.counts["gaps"] == 1


@pytest.mark.parametrize("size", [30.0, 1e6, 1e30])
def test_a_spike_is_left_out_of_the_average(size: float) -> None:
    rng = np.random.default_rng(5)
    block = record(2000)
    noisy = Block(block.data + 0.01 * rng.standard_normal(block.data.shape), NAMES, RATE_HZ)
    spiked = changed(noisy, "u", 1234, size)
    found = tracker(average=True, forgetting=1.0, hop=WINDOW, spikes=("u",))
    kept = found.process(spiked)[-1]
    assert np.max(np.abs(kept.value - 2)) < 0.01
    assert kept.valid.all()
    assert found.counts["spike"] + found.counts["implausible"] == 1


def test_a_spike_makes_windows_invalid_where_nothing_is_averaged() -> None:
    rng = np.random.default_rng(5)
    block = record()
    noisy = Block(block.data + 0.01 * rng.standard_normal(block.data.shape), NAMES, RATE_HZ)
    responses = tracker(spikes=("y",)).process(changed(noisy, "y", 600, 50.0))
    n = np.arange(1000)
    assert np.array_equal(responses.valid.all(axis=1), (n >= 99) & ((n < 600) | (n >= 700)))


def test_clean_noise_has_no_spikes() -> None:
    # 2,000 windows of Gaussian noise; a false one is expected once in 1e6 windows and more.
    rng = np.random.default_rng(8)
    block = record(200_000)
    found = tracker(spikes=("u", "y"), hop=WINDOW)
    found.process(Block(block.data + 0.1 * rng.standard_normal(block.data.shape), NAMES, RATE_HZ))
    assert found.counts["spike"] == 0


def test_a_window_without_excitation_is_not_valid() -> None:
    block = record()
    data = block.data.copy()
    data[0, 400:] = 0.0
    responses = tracker().process(Block(data, NAMES, RATE_HZ))
    assert responses.valid[399].all()
    assert not responses.valid[500:].any()


def test_a_short_window_with_three_bins_for_the_distortion_is_judged_by_these() -> None:
    lines = Lines((1, 4), 12, RATE_HZ, quiet=(2, 3))
    w = np.tile(multisine(lines), 40)
    y = np.roll(w, 1) + 0.01 * np.random.default_rng(0).standard_normal(w.size)
    responses = tracker(lines=lines, hop=12).process(Block(np.array([w, w, y]), NAMES, RATE_HZ))
    assert responses.valid[-1].all()
    assert (responses.distortion[-1] < 0.01).all()


def test_a_line_without_excitation_is_not_valid() -> None:
    lines = Lines.parse("50,100,200,300", RATE_HZ, WINDOW)
    responses = tracker(lines=lines).process(record())
    assert responses.valid[-1].tolist() == [True, True, True, False]


@pytest.mark.parametrize(
    ("options", "code", "argument"),
    [
        ({"dtype": "float16"}, "usage.not-one-of", "dtype"),
        ({"estimator": "jiont"}, "usage.not-one-of", "estimator"),
        ({"excitation": None}, "usage.missing", "excitation"),
        ({"hop": 0}, "usage.out-of-range", "hop"),
        ({"hop": 101}, "usage.out-of-range", "hop"),
        ({"forgetting": 0.0}, "usage.out-of-range", "forgetting"),
        ({"forgetting": 1.5}, "usage.out-of-range", "forgetting"),
        ({"estimator": "indirect"}, "usage.missing", "estimator"),
        ({"quantity": "open loop", "estimator": "direct"}, "usage.missing", "estimator"),
        ({"differenced": ("yy",)}, "usage.unknown-name", "differenced"),
        ({"spikes": ("x",)}, "usage.unknown-name", "spikes"),
        ({"noise": "quiet", "lines": Lines((5,), 100, 1000.0)}, "grid.too-few-detection-lines", "noise"),
        ({"hann": True, "lines": Lines((5, 6), 100, 1000.0)}, "grid.lines-too-close", "lines"),
        ({"hann": True, "noise": "quiet"}, "usage.conflict", "noise"),
    ],
)
def test_settings_that_do_not_fit_are_refused(options: dict, code: str, argument: str) -> None:
    with pytest.raises(LivebodeError) as caught:
        tracker(**options)
    assert (caught.value.code, caught.value.argument) == (code, argument)
    assert "\n" not in str(caught.value)


def test_blocks_that_do_not_fit_are_refused() -> None:
    found, block = tracker(), record()
    found.process(block.cut(0, 100))
    with refused(SignalError, "repeated", first_sample=50, last_sample=99):
        found.process(block.cut(50, 200))
    with refused(SignalError, "rate-differs", rate_hz=2000, lines_rate_hz=1000):
        tracker().process(Block(block.data, NAMES, 2000.0))
    with pytest.raises(LivebodeError, match="there is no channel 'u'"):
        tracker().process(Block(block.data, ("w", "U2", "y"), RATE_HZ))
    with refused(SignalError, "empty"):
        tracker().process(block.cut(0, 0))


def test_an_unknown_logging_moment_is_refused() -> None:
    with pytest.raises(LivebodeError, match="input_logged='later'"):
        Loop(input_logged="later")


def test_an_instruction_set_that_does_not_exist_is_refused_with_those_that_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIVEBODE_INSTRUCTION_SET", "mmx")
    allowed = ["best", *instruction_sets()]
    with refused(UsageError, "not-one-of", argument="LIVEBODE_INSTRUCTION_SET", value="mmx", allowed=allowed):
        tracker()
