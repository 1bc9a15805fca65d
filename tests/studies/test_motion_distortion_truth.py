"""Short form of `python -m studies.motion_distortion`: bounds in motion under friction and play, and without them."""

from __future__ import annotations

import numpy as np
import pytest

from livebode import odd_lines
from studies.motion_distortion import compared, tracked
from studies.moving_machines import drawn, recorded, truth

RATE_HZ, WINDOW, SECONDS = 2500.0, 500, 7.0


LINES = [odd_lines(20, 140, RATE_HZ, WINDOW, seed=7)] * 4


def covered(play: bool, motion: bool) -> tuple[np.ndarray, set[str]]:
    """Shares within both bounds, of four machines of 9 lines, from the first verdict on, and kinds of events."""
    rng, within, kinds = np.random.default_rng(5), [], set()
    axes = drawn(rng, LINES, friction=play, play=play)
    for i, block in enumerate(recorded(axes, LINES, SECONDS, rng)):
        responses, told = tracked(block, LINES[i], float(axes.radius_m[i]), motion=motion)
        kinds |= told
        judged = np.flatnonzero(np.isfinite(responses.distortion).any(axis=1))
        if judged.size:
            error, one, two, sigma, valid = compared(responses[judged[0] :], block, axes.one(i))
            within.append(np.stack([error <= one, error <= two])[:, valid & np.isfinite(sigma)])
    return np.concatenate(within, axis=1).mean(axis=1), kinds


@pytest.mark.parametrize("motion", [False, True])
def test_bounds_cover_and_play_is_not_silent(motion: bool) -> None:
    linear, of_linear = covered(play=False, motion=motion)
    played, of_play = covered(play=True, motion=motion)
    print(linear, of_linear, played, of_play)
    assert np.all(linear >= (0.6, 0.95))
    assert np.all(played >= (0.6, 0.9))
    assert "distorted" in of_play
    assert "distorted" not in of_linear


def test_a_machine_without_friction_and_play_has_the_response_that_is_called_its_truth() -> None:
    """At rest of all noise, while the stiffness does not follow the position."""
    lines, rng = [odd_lines(20, 140, RATE_HZ, WINDOW, seed=7)], np.random.default_rng(2)
    axis = drawn(rng, lines, friction=False, play=False)
    nothing = dict.fromkeys(("varies", "noise", "force_noise", "cogging", "counts", "drift"), np.zeros(1))
    quiet = type(axis)(**{name: nothing.get(name, value) for name, value in vars(axis).items()})
    (block,) = recorded(quiet, lines, SECONDS, rng)
    responses, _ = tracked(block, lines[0], float(axis.radius_m[0]), motion=False)
    middle = responses[np.flatnonzero(responses.valid.all(axis=1))[len(responses) // 8]]
    exact = truth(quiet, lines[0], np.array([0.5]), np.array([0.5]))[0]
    assert np.abs(middle.value / exact - 1).max() < 0.02
