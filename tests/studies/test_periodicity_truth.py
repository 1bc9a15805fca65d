"""A direct estimate is not valid where its input does not repeat, and valid where noise explains the difference."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import chirp

from livebode.core import Block, Event, Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.estimation.periodicity import Periodicity
from livebode.excitation import multisine
from studies.nonperiodic import RATE_HZ, Machine, recorded

WINDOW = 500
LINES = Lines.parse("20:140:20", RATE_HZ, WINDOW)
PERIOD = multisine(LINES) / multisine(LINES).std()


def direct(block: Block, window: int = WINDOW, **options: object) -> tuple[Responses, list[Event]]:
    """Responses after the first window, five for each window, and the events."""
    events: list[Event] = []
    lines = Lines(LINES.bins, window, RATE_HZ)
    settings = Settings(lines=lines, output="y", input="u", estimator="direct", hop=window // 5, **options)  # type: ignore[arg-type]
    found = Tracker(settings).process(block, events.append)
    return found[found.sample >= block.start + window - 1], events


def under(w: np.ndarray, noise: float, *, closed: bool = True) -> Block:
    """A settled part of a run of the machine under this excitation."""
    v = noise * np.random.default_rng(0).standard_normal(w.size)
    return Machine(2).run(w, v, closed=closed).cut(5000, w.size)


def test_noise_of_a_quarter_of_the_power_is_taken_for_another_input_less_than_once_in_a_thousand_windows() -> None:
    rng, lines = np.random.default_rng(1), Lines(tuple(range(1, 101)), 400, RATE_HZ)
    periodicity = Periodicity(lines, 1, "u", [])
    noise = rng.standard_normal((2, 2000, len(lines))) / np.sqrt(2)
    with np.errstate(all="ignore"):
        every = np.arange(2000)
        false = periodicity.process(2 + noise[0] + 1j * noise[1], every >= 0, every, every.astype(float)).mean()
    assert false < 1e-3


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_periodic_input_is_valid_with_noise_up_to_the_signal(noise: float, closed: bool) -> None:
    for options in ({}, {"average": True, "forgetting": 1.0}):
        found, events = direct(under(np.tile(PERIOD, 100), noise, closed=closed), **options)
        assert found.valid.mean() > 0.999
        assert not events


def test_a_slow_change_of_the_amplitude_is_valid() -> None:
    n = np.arange(200 * WINDOW)
    found, _ = direct(under(np.tile(PERIOD, 200) * (1 + 0.3 * np.sin(2 * np.pi * n / n.size)), 0.0))
    assert found.valid.all()


@pytest.mark.parametrize("factor", [2.0, -1.0], ids=["amplitude", "sign"])
def test_a_jump_is_not_valid_for_two_windows(factor: float) -> None:
    w = np.tile(PERIOD, 200)
    w[50_000:] *= factor
    found, events = direct(under(w, 0.01))
    wrong = found.sample[~found.valid.all(axis=1)]
    assert wrong.size
    assert wrong.min() >= 50_000
    assert wrong.max() < 50_000 + 2 * WINDOW
    assert [event.kind for event in events] == ["not-periodic"]


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize(("kind", "share"), [("chirp", 0.05), ("noise", 0.10)])
def test_chirps_and_noise_are_not_valid_after_the_first_windows(kind: str, share: float, closed: bool) -> None:
    block = recorded(Machine(2), kind, 60_000, 1, closed=closed, noise=0.1)  # type: ignore[arg-type]
    found, events = direct(block)
    assert found.valid[100:].mean() < 0.03  # after twenty windows
    assert found.valid.mean() < share
    assert "--estimator lpm" in events[0].message


@pytest.mark.parametrize("samples", [2000, 8000, 30_000])
def test_a_repeated_chirp_longer_than_the_window_is_not_valid(samples: int) -> None:
    t = np.arange(samples) / RATE_HZ
    w = np.resize(chirp(t, 5.0, t[-1], 200.0), 100_000)
    assert direct(under(w, 0.01))[0].valid[100:].mean() < 0.01


@pytest.mark.parametrize("window", [499, 501])
def test_a_window_that_is_wrong_by_one_sample_is_not_valid_after_eight(window: int) -> None:
    assert direct(under(np.tile(PERIOD, 100), 0.01), window)[0].valid[60:].mean() < 0.01
