"""Distortion is in the bound of a machine in motion, and neither noise nor the motion of a linear machine is one.

The machine is a gain that follows the position, with a cube for the distortion, so that the truth is known exactly.
"""

from __future__ import annotations

from itertools import pairwise
from unittest.mock import patch

import numpy as np
import pytest

from livebode.core import Block, Channel, Event, Lines, Responses
from livebode.estimation import Settings, Tracker, moving_distortion
from livebode.estimation.moving_distortion import MovingDistortion, PeriodsAtBins, free_bins
from livebode.excitation import multisine, odd_lines
from tests.support.found import with_events
from tests.support.responses import assert_same

RATE_HZ, WINDOW, PERIODS = 4000.0, 800, 40
LINES = odd_lines(20, 140, RATE_HZ, WINDOW, seed=1)
SETTINGS = Settings(lines=LINES, output="y", input="u", excitation="w", schedule="x", hop=WINDOW // 4)


def record(cube: float, noise: float = 0.01, speed_m_per_s: float = 0.1, seed: int = 1) -> Block:
    """y = (2 + x)·u with a distortion relative to the output's rms, and white noise relative to it."""
    rng = np.random.default_rng(seed)
    w = np.tile(multisine(LINES, phases="random", seed=seed), PERIODS)
    w /= w.std()
    x = speed_m_per_s * np.arange(w.size) / RATE_HZ
    y = (2 + x) * w + 2 * cube * w**3 + 2 * noise * rng.standard_normal(w.size)
    channels = (Channel("w"), Channel("u"), Channel("y", "rad/s"), Channel("x", "m"))
    return Block(np.array([w, w, y, x]), channels, RATE_HZ)


def tracked(block: Block) -> tuple[Responses, list[Event]]:
    responses, events = with_events(Tracker(SETTINGS).process, block)
    return responses[responses.first >= 8 * WINDOW], events


@pytest.mark.parametrize("speed_m_per_s", [0.02, 0.1, 0.4])
@pytest.mark.parametrize("cube", [0.01, 0.05])
def test_a_cube_is_in_the_bound_while_the_gain_follows_the_position(cube: float, speed_m_per_s: float) -> None:
    responses, _ = tracked(record(cube, speed_m_per_s=speed_m_per_s))
    error = np.abs(responses.value - (2 + responses.schedule[:, np.newaxis]))
    assert np.mean(error <= responses.bound(1)) >= 0.6
    assert np.mean(error <= responses.bound(2)) >= 0.96
    assert np.nanmedian(responses.distortion) > 0.02 * cube  # the detection lines show it


def test_a_line_with_more_distortion_than_half_of_its_response_is_not_valid_and_the_event_names_the_speed() -> None:
    responses, events = tracked(record(0.5))
    assert not responses.valid[-1].any()
    told = [event for event in events if event.kind == "distorted"]
    assert sorted(event.details["line_hz"] for event in told) == LINES.frequency_hz.tolist()
    assert "moves at 0.1 m/s" in told[0].message


def test_noise_and_motion_of_a_linear_machine_are_no_distortion() -> None:
    """20 runs: the median sigma is less than 2 % wider, one in a hundred more than 50 %; no line is invalid."""
    wider = []
    for seed in range(20):
        responses, events = tracked(record(0.0, noise=0.03, speed_m_per_s=0.01 * (1 + seed), seed=seed))
        assert responses.valid.all()
        assert "distorted" not in [event.kind for event in events]
        noise = np.sqrt(responses.sigma**2 - np.nan_to_num(responses.distortion) ** 2)
        wider.append(responses.sigma / noise)
    assert np.median(wider) < 1.02
    assert np.quantile(wider, 0.99) < 1.5


def test_skirts_of_a_gain_that_changes_evenly_are_explained() -> None:
    """Without noise, the skirts alone repeat; less than a fifth of the error that they would be taken for remains."""
    block = record(0.0, noise=1e-9, speed_m_per_s=0.4)
    judge = MovingDistortion(LINES, instrument=True)
    assert judge.at[len(LINES) :].tolist() == free_bins(LINES).tolist()
    spectra = np.fft.rfft(block.data[:3].reshape(3, PERIODS, WINDOW))[:, :, judge.at]
    w, u, y = spectra
    position = block["x"].reshape(PERIODS, WINDOW).mean(axis=1)
    usable = np.ones(PERIODS, dtype=np.bool_)
    explained = judge.process(PeriodsAtBins(y, y, u, w, position), usable).distortion[-1]
    with patch.object(moving_distortion, "_SKIRTS", 0.0):
        all_of_them = MovingDistortion(LINES, instrument=True)
        taken = all_of_them.process(PeriodsAtBins(y, y, u, w, position), usable).distortion[-1]
    assert taken.min() > 0.01
    assert np.all(explained < 0.2 * taken)


def test_any_cutting_and_a_restored_tracker_give_the_same_responses_in_motion() -> None:
    block, tracker = record(0.1), Tracker(SETTINGS)
    whole = tracker.process(block)
    assert np.nanmax(np.where(whole.valid, whole.distortion, 0)) > 0.1
    rng, now, parts = np.random.default_rng(3), Tracker(SETTINGS), []
    for begin, end in pairwise([0, *np.sort(rng.integers(1, len(block), 30)).tolist(), len(block)]):
        if end > begin:
            parts.append(now.process(block.cut(begin, end)))
            state, now = now.snapshot(), Tracker(SETTINGS)
            now.restore(state)
    assert_same(Responses.join(parts), whole)


def test_lines_whose_products_fall_on_lines_alone_are_not_judged() -> None:
    assert not free_bins(Lines.parse("20:140:20", RATE_HZ, 400)).size
