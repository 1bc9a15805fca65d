"""Short form of `make healthy`."""

import numpy as np
import pytest

from livebode.monitoring import learn_machine
from livebode.simulation import Sensor
from studies.healthy import CONDITIONS, Condition, healthy_run, simulated, trial
from studies.monitoring_axis import LINES, RADIUS_M, RATE_HZ

COGGING_PER_M = 24 / (2 * np.pi * RADIUS_M)


def test_cogging_and_a_delay_are_learned_and_raise_no_alarm() -> None:
    """The healthy campaign in short (`make healthy`): both at once, runs that gave alarms before, a change detected."""
    late = Sensor(noise_rad_per_s=0.1, velocity_differenced=True)
    machine_with = Condition("both", drive={"torque_ripple_n_m": 0.05}, sensor=late, delay_samples=1)
    assert {"ripple 0.05 N m", "delay of 1.5 samples"} < set(CONDITIONS)
    blocks = list(simulated(machine_with, 9000, strokes=6)())
    learned = learn_machine([lambda: blocks], LINES, input="u", output="velocity", schedule="x", radius_m=RADIUS_M)
    assert learned.ripple.cycles_per_m == pytest.approx([COGGING_PER_M], abs=0.4)
    assert learned.ripple.amplitude_n_m == pytest.approx([0.05 / np.sqrt(2)], rel=0.2)
    assert learned.ripple.peak_n_m == pytest.approx([0.05], rel=0.08)
    assert learned.delay_s * RATE_HZ == pytest.approx(1.5, abs=0.02)
    assert healthy_run(machine_with, learned, 20_000) == []
    # Detected in 95 %: fewer than five of six by chance in 3 %.
    assert [trial(machine_with, learned, seed) for seed in range(40_001, 40_007)].count("stiffness") >= 5
