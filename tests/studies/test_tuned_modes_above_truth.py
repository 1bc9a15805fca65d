"""What `tune` promises holds where a mode is near or above the highest line, on chains that are not its own model."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode import PID, Lines, Responses, TuneError
from livebode_control.tuning import ControllerProposal, PredictedMargins, tune
from livebode_control.tuning.modal_fit import ModalFit, _Modes
from livebode_control.tuning.plant_band import PlantBand
from livebode_control.tuning.predicted import predicted
from livebode_control.tuning.proposal import margins_of
from studies.tune import keeps
from studies.tune_modes_above import LIMITS, Chain, machines, true_margins

NEAR = [one for one in islice(machines(1001), 60) if 1.0 < one.mode_over_top < 2.5][:6]


def known(of: Chain, seed: int, share: float = 0.005) -> Responses:
    """The true response with noise of this share of each line."""
    truth = of.response(of.lines.frequency_hz)[np.newaxis]
    noise = np.random.default_rng(seed).standard_normal((2, *truth.shape)) / np.sqrt(2)
    sigma, ones, row = share * np.abs(truth), np.ones(truth.shape), np.zeros(1, dtype=np.int64)
    value = truth + sigma * (noise[0] + 1j * noise[1])
    return Responses(of.lines, value, sigma, row + np.inf, ones, ones > 0, row, row, row + 0.0, row + 0.0)


def proposed(of: Chain, number: int) -> tuple[ControllerProposal | None, TuneError | None]:
    """The proposal, or the refusal."""
    try:
        return tune(known(of, number), of.loop, LIMITS, loop_checked=True), None
    except TuneError as error:
        return None, error


@pytest.mark.parametrize("number", range(6))
def test_a_mode_just_above_the_lines_breaks_no_promise(number: int) -> None:
    """The truth keeps the margins, or the proposal is refused for what is above, with lines that show more of it."""
    of = NEAR[number]
    found, refused = proposed(of, number)
    if found is None:
        assert refused is not None
        lines, window = refused.facts["lines"], refused.facts["window"] or 8 * of.lines.window
        assert len(Lines.parse(lines, rate_hz=of.rate_hz, window=window)) > len(of.lines)
        return
    truth = true_margins(of, found)
    assert truth is not None, "unstable"
    assert truth.max_sensitivity <= 1.03 * found.promised.max_sensitivity
    assert found.reach.highest_line_hz == of.lines.frequency_hz[-1]
    assert all(db > 0 for _, db in found.reach.resonance_db)
    assert found.plain()["reach"]["sentence"] == found.reach.sentence


def test_the_largest_mode_that_the_lines_permit_covers_the_true_one() -> None:
    """At each frequency above the lines, |G| of the truth is within what the band permits there."""
    inside = []
    for number, of in enumerate(NEAR):
        f = of.dense_hz[(of.dense_hz > 1.01 * of.lines.frequency_hz[-1]) & (of.dense_hz < 0.45 * of.rate_hz)]
        band = PlantBand.of(known(of, number), of.rate_hz)
        limit = np.interp(f, band.frequency_hz[band.above], np.abs(band.rise * band.value)[0, band.above])
        inside.append(bool(np.all(np.abs(of.response(f)) < 1.05 * limit)))
    assert np.mean(inside) >= 0.9


margins = st.builds(
    PredictedMargins,
    st.floats(0.1, 60), st.floats(1, 120), st.floats(1.01, 5), st.floats(0.01, 1.9), st.floats(1, 100),
)  # fmt: skip


@given(margins)
def test_the_largest_unknown_changes_no_margin(of: PredictedMargins) -> None:
    assert keeps(of.with_unknown(0.999 * of.largest_unknown), of)
    assert of.with_unknown(min(1.01 * of.largest_unknown, 0.9999)) != of


def fitted(of: Chain, number: int) -> ModalFit:
    responses = known(of, number)
    return ModalFit.of(of.lines.frequency_hz, responses.value[0], responses.sigma[0], of.rate_hz)


def test_every_mode_of_a_lightly_damped_chain_is_fitted_though_one_alone_removes_little() -> None:
    of = NEAR[4]
    assert of.modes_hz[-1] > 1.15 * of.lines.frequency_hz[-1]
    found = fitted(of, 4)
    assert found.excess < 1.2
    for hz in of.modes_hz:
        assert np.min(np.abs(found.modes[:, 0] / hz - 1)) < 0.01


def test_the_weight_and_sigma_of_an_added_mode_are_those_of_least_squares() -> None:
    found = fitted(NEAR[3], 3)
    f, modes = found.frequency_hz, _Modes.of(found.frequency_hz, np.array([60.0, 300.0, 900.0]))
    weight, sigma = found._added(modes)
    late = np.exp(-2j * np.pi * f / f[-1] * found.theta[0])
    for i, (hz, damping) in enumerate(zip(modes.hz, modes.damping)):
        column = f**2 / (f**2 - hz**2 - 2j * damping * hz * f) * late
        design = found._stacked(np.column_stack([found._slopes(f), column]))
        scale = np.linalg.norm(design, axis=0)
        expected = np.linalg.lstsq(design / scale, found._solution[1], rcond=None)[0][-1] / scale[-1]
        variance = np.linalg.inv((design / scale).T @ (design / scale))[-1, -1] / scale[-1] ** 2
        np.testing.assert_allclose([weight[i], sigma[i]], [expected, np.sqrt(variance)], rtol=1e-5, atol=1e-9)


def test_an_antiresonance_between_two_lines_an_octave_below_its_mode_is_within_the_band() -> None:
    """Without the fitted modes G turned to the wrong side of 0 between 10 and 15 Hz: that loop was unstable."""
    at = Lines.parse("5:120:5, 130:600:10", rate_hz=8000, window=3200).frequency_hz

    def plant(f: np.ndarray) -> np.ndarray:
        zeros, poles = (1 - (f / own) ** 2 + 2j * ratio * f / own for own, ratio in ((14.0, 0.008), (29.6, 0.011)))
        return np.asarray(np.exp(-2j * np.pi * f * 1e-3) / (2j * np.pi * f) * zeros / poles)

    sigma = 0.002 * np.abs(plant(at))[np.newaxis]
    band = PlantBand.at_lines(at, plant(at)[np.newaxis], 3.0 * sigma, sigma, 8000.0)
    near = (band.frequency_hz > 10) & (band.frequency_hz < 15)
    assert np.all(np.abs(plant(band.frequency_hz[near]) - band.value[0, near]) < band.radius[0, near])


def test_margins_are_those_of_the_curve_though_the_lines_are_far_apart_at_the_crossover() -> None:
    """Two inertias with a delay, exact at lines 4 Hz apart, and a loop that crosses at 8 Hz."""
    lines, rate_hz = Lines.parse("4:80:4, 88:320:8", rate_hz=2000, window=1000), 2000.0
    at, dense = lines.frequency_hz, np.geomspace(4, 320, 50_000)
    feedback = PID(gain=2 * np.pi * 8, integral_time_s=0.02, rate_hz=rate_hz)

    def plant(f: np.ndarray) -> np.ndarray:
        zeros, poles = (1 - (f / own) ** 2 + 2j * ratio * f / own for own, ratio in ((30.0, 0.03), (45.0, 0.04)))
        return np.asarray(np.exp(-2j * np.pi * f * 2e-3) / (2j * np.pi * f) * zeros / poles)

    none = np.zeros((1, at.size))
    band = PlantBand.at_lines(at, plant(at)[np.newaxis], none, none, rate_hz)
    loop = (plant(dense) * feedback.response(dense))[np.newaxis]
    found, true = margins_of(band, feedback, 0.0), predicted(dense, loop, np.zeros(loop.shape))
    assert found.max_sensitivity == pytest.approx(true.max_sensitivity, rel=1e-3)
    assert found.disk_margin == pytest.approx(true.disk_margin, rel=1e-3)


def test_the_slopes_of_the_fit_are_those_of_differences() -> None:
    found = fitted(NEAR[3], 3)
    f = NEAR[3].lines.frequency_hz
    first = found._solution[0].size
    for i in range(found.theta.size):
        step = 1e-6 * np.eye(found.theta.size)[i]
        ends = [found._with(found.theta + one)._columns(f) @ found._solution[0] for one in (step, -step)]
        np.testing.assert_allclose(found._slopes(f)[:, first + i], (ends[0] - ends[1]) / 2e-6, rtol=1e-4, atol=1e-3)
