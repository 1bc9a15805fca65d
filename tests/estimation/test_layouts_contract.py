"""Neither the order of the channels nor the layout of a block in memory changes a bit of the responses."""

from itertools import permutations

import numpy as np
import pytest

from livebode.core import Block, Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine

SETTINGS = Settings(lines=Lines.parse("20:100:20", 1000, 50), output="y", input="u", excitation="w", hop=10)
NAMES = ("w", "u", "y")


def signals() -> np.ndarray:
    rng = np.random.default_rng(0)
    w = np.resize(multisine(SETTINGS.lines), 1000)
    u = w + 0.1 * rng.standard_normal(w.size)
    return np.array([w, u, np.roll(u, 3) + 0.1 * rng.standard_normal(w.size)])


def tracked(data: np.ndarray, names: tuple[str, ...], size: int) -> Responses:
    tracker = Tracker(SETTINGS)
    starts = range(0, data.shape[1], size)
    return Responses.join(
        [tracker.process(Block(data[:, at : at + size], names, rate_hz=1000, start=at)) for at in starts]
    )


@pytest.mark.parametrize("size", [50, 170, 1000])
@pytest.mark.parametrize("order", ["C", "F"])
def test_any_order_of_channels_and_any_layout_has_the_same_bits(order: str, size: int) -> None:
    every, expected = signals(), tracked(signals(), NAMES, 1000)
    for places in permutations(range(3)):
        data = np.array(every[list(places)], order=order)  # type: ignore[call-overload]
        assert tracked(data, tuple(NAMES[i] for i in places), size).equals(expected)
