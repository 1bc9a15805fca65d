"""A limit passes and fails with the risk of its guard band, for all values together, and not where data are missing."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from livebode.configuration import LimitSection
from livebode.core import PID, Loop
from livebode.fitting import mean_response
from livebode_reports.acceptance import NO_FIT, NO_LINE, NO_LOOP, LimitEvidence, MeasuredValues, accepted, judged
from tests.support.reports import LINES, measured, plant

_FINITE = st.floats(-1e6, 1e6)
_PAIRS = st.lists(st.tuples(_FINITE, st.floats(0, 1e6)), min_size=1, max_size=5)


@given(pairs=_PAIRS, low=_FINITE, high=_FINITE)
@example(pairs=[(1e-200, 1.0)], low=0.0, high=0.0)
def test_all_intervals_inside_pass_and_one_outside_fails(
    pairs: list[tuple[float, float]], low: float, high: float
) -> None:
    limit = LimitSection(quantity="resonance_hz", min=min(low, high), max=max(low, high) + 1)
    value, bound = np.array(pairs).T
    found = judged(limit, MeasuredValues.around(value, bound, "Hz"))
    ends = value - bound, value + bound
    inside = (ends[0] > limit.min) & (ends[1] < limit.max)
    outside = (ends[1] < limit.min) | (ends[0] > limit.max)
    assert found.result == ("fail" if outside.any() else "pass" if inside.all() else "undecided")
    assert found.value in value
    if found.result == "undecided":
        assert found.times >= 1 - 1e-9


@pytest.mark.parametrize("values", [1, 8])
def test_a_machine_at_its_limit_passes_and_fails_in_at_most_five_percent_together(values: int) -> None:
    """4,000 measurements each; for one value 2.5 % pass and 2.5 % fail, within four deviations of the count."""
    generator, runs = np.random.default_rng(values), 4000
    limit = LimitSection(quantity="phase_margin_deg", min=45.0)
    deviations = {1: 1.959964, 8: 2.734369}[values]  # of the standard normal: 5 % outside, for all together
    results = [
        judged(
            limit, MeasuredValues.around(45 + generator.standard_normal(values), np.full(values, deviations), "deg")
        ).result
        for _ in range(runs)
    ]
    spread = 4 * np.sqrt(0.025 * 0.975 / runs)
    assert results.count("pass") / runs < 0.025 + spread
    assert results.count("fail") / runs < 0.025 + spread
    if values == 1:
        assert results.count("pass") / runs > 0.025 - spread


def test_the_data_that_are_missing_decide_when_they_are_there() -> None:
    limit = LimitSection(quantity="stiffness", max=10.0)
    found = judged(limit, MeasuredValues.around(np.array([9.0]), np.array([3.0]), "N/m"))
    assert (found.result, found.times) == ("undecided", 9.0)
    more = judged(limit, MeasuredValues.around(np.array([9.0]), np.array([3.0 / np.sqrt(9.0 + 1e-6)]), "N/m"))
    assert more.result == "pass"
    assert judged(limit, MeasuredValues.around(np.array([10.0]), np.array([3.0]), "N/m")).times == inf


def test_a_magnitude_mask_compares_the_lines_of_its_band_with_the_response_that_it_names() -> None:
    mean = mean_response(measured(300, 1))[0]
    loop = Loop(feedback=PID(gain=0.05, rate_hz=LINES.rate_hz))
    true = plant(LINES.frequency_hz, 62.0)[0]
    behind = loop.feedback_at(LINES.frequency_hz)
    truth = {
        "|G|": true,
        "|L|": behind * true,
        "|T|": behind * true / (1 + behind * true),
        "|S|": 1 / (1 + behind * true),
    }
    band = (LINES.frequency_hz >= 60) & (LINES.frequency_hz <= 100)
    of = LimitEvidence(mean, loop, None, None)
    for quantity, response in truth.items():
        peak_db = 20 * np.log10(np.abs(response[band]).max())
        limits = [LimitSection(quantity=quantity, max=peak_db + d, band_hz=[60, 100]) for d in (1.0, 0.0, -1.0)]
        over, at, under = accepted(limits, of)
        assert (over.result, at.result, under.result) == ("pass", "undecided", "fail")
        assert abs(at.value - peak_db) < at.bound
        assert 60 <= at.at_hz <= 100
    low = LimitSection(quantity="|G|", min=-60.0)
    assert accepted([low], of)[0].result == "pass"


def test_what_was_not_measured_is_not_decided_and_says_why() -> None:
    mean = mean_response(measured(300, 1))[0]
    of = LimitEvidence(mean, Loop(), None, None)
    limits = [
        LimitSection(quantity="resonance_hz", min=1.0), LimitSection(quantity="gain_margin_db", min=1.0),
        LimitSection(quantity="|T|", max=1.0), LimitSection(quantity="|G|", max=1.0, band_hz=[1.0, 2.0]),
    ]  # fmt: skip
    found = accepted(limits, of)
    assert [(a.result, a.reason) for a in found] == [
        ("undecided", reason) for reason in (NO_FIT, NO_LOOP, NO_LOOP, NO_LINE)
    ]  # fmt: skip
    assert found[0].plain()["value"] is None
