"""Short form of `python -m studies.motion_distortion`: bounds in motion under friction and play, and without them."""

from __future__ import annotations

import numpy as np

from livebode import odd_lines
from studies.motion_distortion import compared, tracked
from studies.moving_machines import drawn, recorded, truth

RATE_HZ, WINDOW, SECONDS = 2500.0, 500, 7.0


def test_bounds_cover_and_play_is_not_silent() -> None:
    """Four machines of 9 lines and some 20 windows; windows before the first verdict are left out."""
    lines = [odd_lines(20, 140, RATE_HZ, WINDOW, seed=7)] * 4
    for play, least in ((False, (0.6, 0.95)), (True, (0.6, 0.9))):
        rng, within, kinds = np.random.default_rng(5), [], set()
        axes = drawn(rng, lines, friction=play, play=play)
        for i, block in enumerate(recorded(axes, lines, SECONDS, rng)):
            responses, told = tracked(block, lines[i], float(axes.radius_m[i]), motion=False)
            judged = responses[np.flatnonzero(np.isfinite(responses.distortion[:, 0]))[0] :]
            error, one, two, sigma, valid = compared(judged, block, axes.one(i))
            within.append(np.stack([error <= one, error <= two])[:, valid & np.isfinite(sigma)])
            kinds |= told
        covered = np.concatenate(within, axis=1).mean(axis=1)
        print(play, covered, kinds)
        assert np.all(covered >= least)
        assert ("distorted" in kinds) == play


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
