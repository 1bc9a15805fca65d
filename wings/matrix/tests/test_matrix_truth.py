"""Matrices of responses, compared with the closed form, with an offline oracle and with an integration of the ODEs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from livebode.core import PID, Block, Lines, MatrixLoop, MatrixResponses
from livebode.excitation import MatrixExcitation
from livebode.simulation import Gantry, GantryLoop
from livebode_matrix import MatrixSettings, MatrixTracker

LINES = Lines.parse("10:60:10", rate_hz=1000, window=200)
LOOP = GantryLoop(gantry=Gantry(motor_viscous_n_m_s=0.05), rate_hz=1000.0)
SETTLE = LOOP.settle_periods(LINES.window, 1e-12)
PI = PID(gain=LOOP.gain_n_m_s, integral_time_s=LOOP.integral_time_s, rate_hz=1000.0)
DESCRIBED = MatrixLoop(feedback=[[PI, None, None], [None, PI, None]])
OUTPUTS = ["velocity1", "velocity2", "cart"]
TRUTH = LOOP.gantry.response(LINES.frequency_hz, LOOP.rate_hz)


def excitation(kind: str, **options: int) -> MatrixExcitation:
    periods = {"dwell": SETTLE + 2, "settle": SETTLE} | options
    return getattr(MatrixExcitation, kind)(LINES, 2, [0.5, 0.3], **periods)


def settings(estimator: str = "joint", **options: object) -> MatrixSettings:
    names = ["u1", "u2"], [] if estimator == "direct" else ["w1", "w2"]
    given = {"dwell": SETTLE + 2, "settle": SETTLE, "loop": DESCRIBED, "hop": 50} | options
    signals = {"output": OUTPUTS, "input": names[0], "excitation": names[1]}
    return MatrixSettings(**({"lines": LINES, "estimator": estimator} | signals | given))  # type: ignore[arg-type]


def recording(kind: str, repetitions: int = 3, noise: float = 0.0, seed: int = 0) -> Block:
    w = np.tile(excitation(kind).samples, repetitions)
    rng = np.random.default_rng(seed)
    return LOOP.simulate(w, noise=noise * rng.standard_normal((3, w.shape[1])))


@pytest.mark.parametrize("kind", ["orthogonal", "interleaved", "successive"])
@pytest.mark.parametrize("estimator", ["direct", "joint", "indirect"])
def test_without_noise_every_estimator_gives_the_sampled_plant(kind: str, estimator: str) -> None:
    responses = MatrixTracker(settings(estimator)).process(recording(kind))
    valid = responses.valid.all(axis=(1, 2))
    assert valid.sum() > 5
    size = np.linalg.norm(TRUTH, axis=(1, 2))
    error = np.linalg.norm(responses.value[valid] - TRUTH, axis=(2, 3)) / size
    assert error.max() < 1e-9
    assert np.nanmax(responses.sigma[valid] / np.abs(TRUTH)) < 1e-9


@pytest.mark.parametrize(("experiments", "memory", "dof"), [(2, 4, 6), (4, 2, 4)])
def test_the_best_linear_approximation_of_the_whole_recording_is_the_mean_of_the_tracker(
    experiments: int, memory: int, dof: int
) -> None:
    """An offline oracle: FFTs of the settled periods, and least squares over all of them with w as instrument."""
    block = recording("orthogonal", 4, noise=0.05)
    options = {"experiments": experiments, "memory": memory, "hop": 200}
    found = MatrixTracker(settings(average=True, **options)).process(block)[-1:]
    periods = block.data.reshape(7, 8, SETTLE + 2, 200)[:, :, -1]
    spectra = np.fft.fft(periods, axis=2)[:, :, list(LINES.bins)]
    w, u, y = spectra[:2], spectra[2:4], spectra[4:]
    for k in range(len(LINES)):
        oracle = y[:, :, k] @ w[:, :, k].conj().T @ np.linalg.inv(u[:, :, k] @ w[:, :, k].conj().T)
        assert np.allclose(found.value[0, k], oracle, rtol=1e-9, atol=1e-9 * np.abs(oracle).max())
    assert found.dof[0] == dof


def test_bounds_of_each_entry_cover_the_truth_as_stated() -> None:
    """Windows of one recording that do not overlap: 200 matrices of 24 entries; 3 σ of the share is 4 points."""
    many = LOOP.simulate(
        np.tile(excitation("orthogonal", dwell=3, settle=2).samples, 200),
        noise=0.05 * np.random.default_rng(3).standard_normal((3, 200 * 2 * 3 * 200)),
    )
    found = MatrixTracker(settings(dwell=3, settle=2, hop=200)).process(many)[2 * 8 :: 2]
    error = np.abs(found.value - TRUTH)
    for c, nominal in ((1.0, 0.632), (2.0, 0.982)):
        share = np.mean(error <= found.bound(c), axis=(0, 1))
        assert (np.abs(share - nominal) < 0.04).all(), share


def test_the_prediction_is_the_scatter_of_the_estimates_and_the_peaks_those_of_the_recording() -> None:
    used = excitation("orthogonal", dwell=3, settle=2)
    predicted = used.predict(lambda f: LOOP.gantry.response(f, LOOP.rate_hz), 0.05, DESCRIBED)
    w = np.tile(used.samples, 150)
    noise = 0.05 * np.random.default_rng(4).standard_normal((3, w.shape[1]))
    found = MatrixTracker(settings(dwell=3, settle=2, hop=200)).process(LOOP.simulate(w, noise=noise))[1::2]
    rms = np.sqrt(np.mean(np.abs(found.value - TRUTH) ** 2, axis=0))
    assert np.abs(np.sqrt(np.mean((rms / predicted.sigma) ** 2, axis=0)) - 1).max() < 0.1
    quiet = LOOP.simulate(w[:, :7200])
    settled = quiet.data.reshape(7, 12, 3, 200)[:, 6:, -1]
    centred = settled - settled.mean(axis=2, keepdims=True)
    assert np.allclose(np.abs(centred[2:4]).max(axis=(1, 2)), predicted.input_peak, rtol=1e-3)
    assert np.allclose(np.abs(centred[4:]).max(axis=(1, 2)), predicted.output_peak, rtol=1e-3)


def test_the_largest_excitation_reaches_one_limit_and_exceeds_none() -> None:
    def plant(f: np.ndarray) -> np.ndarray:
        return LOOP.gantry.response(f, LOOP.rate_hz)

    limits = {"input_max": [0.5, 0.4], "output_max": [20.0, 20.0, 0.3]}
    limited = excitation("interleaved").within_limits(plant, loop=DESCRIBED, **limits)  # type: ignore[arg-type]
    reached = limited.predict(plant, 0.05, DESCRIBED)
    shares = np.concatenate([reached.input_peak / limits["input_max"], reached.output_peak / limits["output_max"]])
    assert shares.max() == pytest.approx(1.0)


def test_covariance_between_entries_is_that_of_many_estimates() -> None:
    w = np.tile(excitation("orthogonal", dwell=3, settle=2).samples, 300)
    rng = np.random.default_rng(5)
    noise = 0.05 * np.array([[1, 0, 0], [0.8, 0.6, 0], [0, 0, 0.1]]) @ rng.standard_normal((3, w.shape[1]))
    found = MatrixTracker(settings(dwell=3, settle=2, hop=200, memory=40)).process(LOOP.simulate(w, noise=noise))
    error = (found.value - TRUTH)[1::2].reshape(-1, len(LINES), 6)
    seen = np.einsum("rka,rkb->kab", error, error.conj()) / len(error)
    stated = found.covariance[81::2].mean(axis=0).reshape(-1, 6, 6)
    scale = np.sqrt(np.einsum("kaa->ka", stated).real)
    correlation = [c / scale[:, :, None] / scale[:, None, :] for c in (seen, stated)]
    assert np.abs(correlation[0] - correlation[1]).max() < 0.3
    assert np.abs((correlation[0] - correlation[1]).mean(axis=0)).max() < 0.1
    assert np.abs(correlation[1][:, 0, 2]).min() > 0.6  # the noise of the two motors is alike


def test_the_gantry_moves_as_its_equations_integrated_by_another_program() -> None:
    gantry = Gantry(cart_m=-0.3)
    mass, damping, stiffness = gantry.matrices
    torque = np.random.default_rng(6).standard_normal((2, 40))
    a, b, c = gantry.sampled(1000.0)
    state, own = np.zeros(8), []
    for u in torque.T:
        state = a @ state + b @ u
        own.append(c @ state)
    reached, theirs = np.zeros(8), []
    for u in torque.T:
        force = np.array([*u, 0.0, 0.0])

        def slope(_: float, x: np.ndarray, force: np.ndarray = force) -> np.ndarray:
            return np.concatenate([x[4:], np.linalg.solve(mass, force - damping @ x[4:] - stiffness @ x[:4])])

        reached = solve_ivp(slope, (0, 1e-3), reached, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
        theirs.append([reached[4], reached[5], reached[6] - 0.3 * reached[7]])
    assert np.abs(np.array(own) - theirs).max() < 1e-6 * np.abs(theirs).max()


def test_the_place_of_the_cart_moves_the_modes_and_the_response_with_them() -> None:
    here, there = Gantry(cart_m=0.0), Gantry(cart_m=0.45)
    assert (here.modes_hz > there.modes_hz).all()
    moved = dataclasses.replace(LOOP, gantry=there)
    block = moved.simulate(np.tile(excitation("successive").samples, 1))
    responses: MatrixResponses = MatrixTracker(settings()).process(block)
    assert np.allclose(responses.value[-1], there.response(LINES.frequency_hz, 1000.0), rtol=1e-9)
    assert not np.allclose(responses.value[-1], TRUTH, rtol=1e-2)
