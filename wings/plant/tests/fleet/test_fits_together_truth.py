"""Fits, derived quantities and margins of several axes at once are those of each axis by itself."""

from __future__ import annotations

import numpy as np

from livebode.configuration import FitSection
from livebode.core import PID, Loop, PlantKinds
from livebode.fitting import EvaluationGrid, TwoMass
from livebode.runtime import Fits
from livebode_plant.fleet.alike_axes import process_together
from tests.support.fitted import LINES, TRUTH, noisy

BELT = TwoMass(radius_m=0.019)
VELOCITY = Loop(feedback=PID(gain=0.2308, integral_time_s=0.2, rate_hz=4000))
SECTION = FitSection(model="two-mass", radius_m=0.019)


def test_a_hall_of_unlike_axes_gives_what_each_gives_alone() -> None:
    loops = [VELOCITY, VELOCITY, Loop(), VELOCITY]
    softer = [1.0, 0.9, 0.8, 0.7]
    runs = []
    for factor in softer:
        values = np.repeat(TRUTH[np.newaxis], 24, axis=0)
        values[:, 2] *= factor
        runs.append(noisy(BELT.at(values, EvaluationGrid.of(LINES)), LINES, 0.01, 24))
    together, alone = ([Fits.of(SECTION, loop, PlantKinds()) for loop in loops] for _ in range(2))
    for a, b in ((0, 17), (17, 18), (18, 24)):
        batches = [run[a:b] for run in runs]
        for found, fits, batch in zip(process_together(together, batches), alone, batches):
            expected, events = fits.process(batch)
            assert [one.model for one in found[0]] == [one.model for one in expected]
            for one, other in zip(found[0], expected):
                assert list(one.status) == list(other.status)
                assert np.allclose(one.value, other.value, rtol=1e-6, equal_nan=True)
                assert np.allclose(one.sigma, other.sigma, rtol=1e-5, equal_nan=True)
            assert [e.message for e in found[1]] == [e.message for e in events]
    assert [len(fits.summary(None)["statuses"]) for fits in together] == [1, 1, 1, 1]
    assert [one.loop is None for one in together] == [False, False, True, False]
