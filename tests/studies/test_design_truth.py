"""Short form of `python -m studies.design`: predicted peaks are those of the simulated axis within 10 %."""

import numpy as np
import pytest

from livebode.excitation import Waveform
from livebode.simulation import extremes
from livebode_design import belt_machine, peaks, worst
from studies.design import MOVING, STANDSTILL


@pytest.mark.parametrize("case", STANDSTILL)
def test_predicted_peaks_at_standstill_are_simulated_within_ten_percent(case):
    axis, lines, samples = STANDSTILL[case]
    _within_ten_percent(axis, lines, samples, extremes(axis, samples))


@pytest.mark.parametrize("case", MOVING)
def test_predicted_peaks_during_a_motion_are_simulated_within_ten_percent(case):
    """Simulated: the largest over twelve alignments of excitation and motion, and two cycles; the first is smaller."""
    axis, lines, samples = MOVING[case]
    cycle_s = len(axis.motion.cycle(4000)[0]) / 4000
    _within_ten_percent(axis, lines, samples, extremes(axis, samples, alignments=12, seconds=2 * cycle_s))


def _within_ten_percent(axis, lines, samples, simulated):
    predicted = worst(peaks(Waveform(lines, samples), belt_machine(axis)))
    at_m = axis.motion.cycle(4000)[0]
    for name, (low, high) in simulated.items():
        # Of the travel what comes beyond each end of the way; of the rest each extreme.
        ends = (at_m.min(), at_m.max()) if name == "travel" else (0.0, 0.0)
        beyond = np.array([ends[0] - low, high - ends[1]])
        margin = np.array([ends[0] - predicted[name].low, predicted[name].high - ends[1]])
        if at_m.size == 1:  # the smaller end of a standing axis is as the noise has it
            margin, beyond = np.max(margin), np.max(beyond)
        assert np.all(np.abs(margin - beyond) <= 0.1 * np.max(beyond)), (name, margin, beyond)
