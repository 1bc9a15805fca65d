"""Each peer is right where the answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lfilter

from livebode import multisine
from livebode.simulation import BeltAxis, Mechanics, Sensor, SimulatedAxis, Standstill
from studies.peers import kalman, least_squares, moving, rls, sliding_welch, smoother, starts, two_mass
from studies.peers.arx import Order, Prepared, rows
from studies.peers.recording import HOP, LINES, MAIN, RATE_HZ, Recording, record
from studies.peers.score import score
from studies.peers.tracked import CENTRE, by, track

THETA = np.array([-1.5, 0.8, -0.1, 0.3, 1.0, 0.5])  # a1 … a3, b1 … b3


def arx_record(samples: int) -> tuple[np.ndarray, np.ndarray]:
    u = np.random.default_rng(3).standard_normal(samples)
    return u, lfilter([0, *THETA[3:]], [1, *THETA[:3]], u)


def at_standstill(seconds: float, noise_rad_per_s: float) -> Recording:
    axis = BeltAxis(
        mechanics=Mechanics(frozen_position_m=0.8),
        motion=Standstill(position_m=0.8),
        excitation_n_m=multisine(LINES),
        seconds=seconds,
        sensor=Sensor(noise_rad_per_s=noise_rad_per_s),
        seed=1,
    )
    block, truth = SimulatedAxis(axis).run()
    return Recording(MAIN, block, truth, np.array([len(block) - 1]))


@pytest.fixture(scope="module")
def quiet() -> Recording:
    return at_standstill(5.0, 0.0)


def apart(found: np.ndarray, true: np.ndarray) -> float:
    return float(np.max(np.abs(found / true - 1)))


def test_two_masses_in_closed_form_are_those_of_the_axis(quiet: Recording) -> None:
    last = int(quiet.judged[0])
    exact = quiet.truth.sampled(last).response(LINES.frequency_hz)
    assert apart(quiet.true_response(quiet.judged)[0], exact) < 1e-10


def test_the_fit_finds_what_made_the_responses_far_from_its_start() -> None:
    factors = np.random.default_rng(0).uniform(0.6, 1.6, (50, 4))
    true = two_mass.NOMINAL * factors
    measured = two_mass.response(true, LINES.frequency_hz, RATE_HZ)
    found = two_mass.fit(measured, LINES.frequency_hz, RATE_HZ)
    assert apart(found, true) < 1e-6
    measured[3, 2] = np.nan
    assert np.isnan(two_mass.fit(measured, LINES.frequency_hz, RATE_HZ)).any(axis=1).tolist() == [
        row == 3 for row in range(50)
    ]


def test_rls_finds_an_arx_model_exactly() -> None:
    u, y = arx_record(2000)
    found = rls.recursion(Order(3, 3).regressors(u, y), y, 1 - 1 / 200, rls.START)
    assert np.abs(found[-1] - THETA).max() < 1e-6


def test_rls_outlives_a_record_of_little_content() -> None:
    u, y = np.sin(0.3 * np.arange(40_000)), np.sin(0.3 * np.arange(40_000) - 0.5)
    found = rls.recursion(Order(3, 3).regressors(u, y), y + 1e-3 * arx_record(40_000)[0], 1 - 1 / 200, rls.START)
    assert np.isfinite(found).all()


def test_least_squares_finds_an_arx_model_exactly_once_its_window_is_full() -> None:
    u, y = arx_record(300)
    last = np.array([20, 98, 99, 299])
    found = least_squares.solve(Order(3, 3).regressors(u, y), y, last, 100)
    assert np.isnan(found).all(axis=1).tolist() == [True, True, False, False]
    assert np.abs(found[2:] - THETA).max() < 1e-9


def test_rls_that_forgets_nothing_is_least_squares() -> None:
    u, y = arx_record(400)
    y = y + 0.1 * np.random.default_rng(4).standard_normal(400)
    phi = Order(3, 3).regressors(u, y)
    whole = least_squares.solve(phi, y, np.array([399]), 400)[0]
    assert np.abs(rls.recursion(phi, y, 1.0, 1e8)[-1] - whole).max() < 1e-6


def test_an_arx_model_responds_as_its_difference_equation() -> None:
    model = Order(1, 1)
    z = np.exp(2j * np.pi * LINES.frequency_hz / 500.0)
    found = model.response(np.array([[-0.9, 2.0]]), 500.0)[0]
    assert apart(found, 2.0 / (z - 0.9)) < 1e-12
    u = np.arange(5.0)
    assert Order(1, 2, first=0).regressors(u, 10 * u)[3].tolist() == [-20.0, 3.0, 2.0]


def test_prepared_signals_are_the_newest_at_each_row() -> None:
    newest, kept = rows(4000, every=8)
    u, _ = Prepared(15.0, 170.0, every=8, order=2).signals(np.ones(4000), np.ones(4000))
    assert newest[:2].tolist() == [HOP - 1, 2 * HOP - 1]
    assert np.all(8 * kept + 7 <= newest)
    assert np.all(newest < 8 * (kept + 1) + 7)
    assert len(u) == 500


@pytest.mark.parametrize("peer", [rls.textbook, rls.tuned, least_squares.sliding])
def test_arx_peers_find_the_machine_at_standstill_without_noise(peer, quiet: Recording) -> None:
    true = quiet.true_response(quiet.judged)[0]
    assert apart(peer(quiet).at(quiet.judged).value[0], true) < 0.02


def test_welch_and_livebode_find_the_machine_at_standstill_without_noise(quiet: Recording) -> None:
    true = quiet.true_response(quiet.judged)[0]
    for peer in (sliding_welch.sliding, by(track)):
        assert apart(peer(quiet).at(quiet.judged).value[0], true) < 1e-5


def test_livebode_is_dated_at_the_centre_by_default(quiet: Recording) -> None:
    assert by(track)(quiet).delay == CENTRE == 199.5
    assert by(track, 260.0)(quiet).delay == 260.0


def test_the_filter_converges_to_the_machine_at_standstill() -> None:
    recording = at_standstill(2.5, 0.1)
    answer = kalman.tuned(recording).at(recording.judged)
    assert apart(answer.parameters[0, [0, 2]], two_mass.NOMINAL[[0, 2]]) < 0.02
    assert apart(answer.value[0], recording.true_response(recording.judged)[0]) < 0.05


STATE = kalman.START + np.array([1e-5, 2.0, 0.03, 0.1, 0.2, -0.1, 0.05, 3.0, 0.4])


def test_the_filter_moves_as_the_exact_model() -> None:
    new, _ = kalman.moved(STATE, 1.5, 1 / RATE_HZ)
    stiffness, damping, inertia, load = np.exp(STATE[3:7])
    r = kalman.RADIUS_M
    force = np.array([stiffness, r * damping, -damping])
    a = np.array([[0, r, -1], -r / inertia * force, force / load])
    b = np.array([0, 1.5 / inertia, -STATE[7] / load])
    whole = expm(np.block([[a, b[:, np.newaxis]], [np.zeros((1, 4))]]) / RATE_HZ)
    assert np.allclose(new, whole[:3, :3] @ STATE[:3] + whole[:3, 3], rtol=1e-5, atol=1e-10)


def test_the_filter_knows_the_slope_of_its_model_and_spreads_by_it() -> None:
    _, slope = kalman.moved(STATE, 1.5, 1 / RATE_HZ)
    for j, step in enumerate([1e-7, 1e-3, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-3]):
        ends = [kalman.moved(STATE + way * step * np.eye(9)[j], 1.5, 1 / RATE_HZ)[0] for way in (1, -1)]
        numeric = (ends[0] - ends[1]) / (2 * step)
        assert np.allclose(slope[:, j], numeric, rtol=1e-6, atol=1e-9 * np.abs(slope).max(axis=1))
    whole = np.eye(9)
    whole[:3, :8], whole[3, 8] = slope, 1 / RATE_HZ
    root = np.random.default_rng(5).standard_normal((9, 9))
    noise = np.diag(kalman.WANDER**2 / RATE_HZ)
    spread = kalman.spread(root @ root.T, slope, 1 / RATE_HZ, kalman.WANDER)
    assert np.allclose(spread, whole @ root @ root.T @ whole.T + noise)


def test_the_moving_model_and_what_it_corrects_are_the_machine_without_noise() -> None:
    recording = record(0, noise_rad_per_s=0.0)
    for peer in (moving.corrected, moving.model):
        found = score([recording], [peer(recording)])
        assert found.magnitude_db < 0.02
        assert found.stiffness_percent < 0.1
        assert found.inertia_percent < 0.05


def test_the_smoother_goes_back_as_rauch_tung_and_striebel_wrote_it() -> None:
    block, tick_s = starts.beginning(0), 1 / RATE_HZ
    u, y, count = block["u"], block["velocity"], 300
    covariances = np.empty((len(y), 9, 9))
    start = kalman.START, kalman.DOUBT, kalman.WANDER, 0.1, tick_s
    states = kalman.filtered(u, y, *start, covariances)
    found = smoother.backwards(u, states, covariances, 0, count - 1, kalman.WANDER, tick_s)
    assert np.array_equal(found[-1], states[count - 1])
    later = states[count - 1]
    for n in range(count - 2, -1, -1):
        new, slope = kalman.moved(states[n], u[n], tick_s)
        step = np.eye(9)
        step[:3, :8], step[3, 8] = slope, tick_s
        foretold = step @ states[n]
        foretold[:3] = new
        after = step @ covariances[n] @ step.T + np.diag(kalman.WANDER**2 * tick_s)
        size = np.sqrt(np.diag(after))
        inverse = np.linalg.inv(after / np.outer(size, size)) / np.outer(size, size)
        later = states[n] + covariances[n] @ step.T @ inverse @ (later - foretold)
        assert np.allclose(found[n], later, rtol=1e-6, atol=1e-9)


def test_a_row_that_was_not_estimated_is_refused(quiet: Recording) -> None:
    answer = by(track)(quiet)
    with pytest.raises(ValueError, match="no estimate"):
        replace(answer).at(np.array([25]))


def test_the_filter_diverges_only_where_its_start_is_unknown() -> None:
    block = starts.beginning(0)
    assert not starts.diverges(block, kalman.DOUBT)
    assert starts.diverges(block, np.full(9, np.inf))
