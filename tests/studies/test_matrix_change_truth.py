"""Modes, parameters and changes of a gantry's matrices, compared with the truth of the simulation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from livebode.core import FitError, GridError, Lines, MatrixResponses, UsageError
from livebode.fitting import mean_matrix, outputs_of, solve
from livebode.simulation import GantryLoop
from livebode_matrix import (
    MatrixModes,
    MatrixMonitor,
    MatrixSettings,
    MatrixTracker,
    compare_gantries,
    compare_matrices,
    fit_gantry,
    fit_matrix,
    read_gantry,
)
from livebode_matrix.change import tail
from livebode_matrix.gantry_fit import parameters_of
from livebode_matrix.modes import chosen
from livebode_matrix.whitening import WeightedMatrix, row_scatter
from studies.matrix_change import EXCITATION, GANTRY, LINES, PERIODS, RATE_HZ, begun, matrices, true_modes

RUNS = 12


@pytest.fixture(scope="module")
def healthy() -> list[MatrixResponses]:
    return matrices(GANTRY, RUNS, np.random.default_rng(100))


@pytest.fixture(scope="module")
def fitted(healthy: list[MatrixResponses]) -> MatrixModes:
    return fit_matrix(healthy[0], order=7)


def changed(seed: int = 101, **parts: float) -> list[MatrixResponses]:
    return matrices(replace(GANTRY, **parts), 3, np.random.default_rng(seed))


def complex_normal(rng: np.random.Generator, *shape: int) -> np.ndarray:
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def test_modes_and_shapes_are_those_of_the_machine(fitted: MatrixModes) -> None:
    """One recording: 6 numbers within 4 sigma, and the shapes of the undamped modes within 5 %."""
    found = fitted
    assert found.status == "ok"
    assert found.order == 7
    for r, pair in enumerate(true_modes(GANTRY)):
        for name, truth in zip(("frequency", "damping"), pair):
            assert abs(found[f"{name}_{r + 1}"] - truth) < 2.05 * found.bound(f"{name}_{r + 1}")
    mass, _, stiffness = GANTRY.matrices
    squares, vectors = np.linalg.eig(np.linalg.solve(mass, stiffness))
    order = np.argsort(squares)[-3:]
    for r, mode in enumerate(vectors[:2, order].T):
        shown = {name: value for name, value, _, _ in found.rows()}
        sizes = [shown[f"shape_{r + 1} velocity{o + 1}"] for o in range(2)]
        turns = [shown[f"shape phase_{r + 1} velocity{o + 1}"] for o in range(2)]
        assert np.allclose(sizes, np.abs(mode) / np.abs(mode).max(), atol=0.05)
        assert (abs(turns[0] - turns[1]) > 90) == (mode[0] * mode[1] < 0)


def test_bounds_of_modes_and_parameters_cover(healthy: list[MatrixResponses], fitted: MatrixModes) -> None:
    """12 recordings; `python -m studies.matrix_change` has 200. Off by less than four deviations of the binomial."""
    truth = true_modes(GANTRY)
    inside = []
    for one in healthy:
        found = fit_matrix(one, like=fitted)
        inside += [
            abs(found[f"{n}_{r + 1}"] - t) < found.bound(f"{n}_{r + 1}")
            for r, pair in enumerate(truth)
            for n, t in zip(("frequency", "damping"), pair)
        ]
    assert abs(np.mean(inside) - 0.95) < 4 * np.sqrt(0.95 * 0.05 / len(inside))
    fits = [fit_gantry(one, replace(GANTRY, stiffness_n_per_m=3.6e5, beam_kg=13.0)) for one in healthy]
    covered = np.mean([np.abs(one.value - parameters_of(GANTRY)) < one.bounds() for one in fits])
    assert abs(covered - 0.95) < 4 * np.sqrt(0.95 * 0.05 / (RUNS * 11))
    assert all(one.epsilon == 0 and one.settled for one in fits)


def test_terms_that_noise_shared_by_the_entries_seems_to_show_are_removed(
    healthy: list[MatrixResponses], fitted: MatrixModes
) -> None:
    """One recording, and the machine's poles with an integrator."""
    assert fitted.best is not None
    of, one = fitted.best.structure, healthy[1]
    outs = outputs_of([one[-1:].entry(o, i) for o in range(2) for i in range(2)], fitted.outputs, None, "zero-order")
    begun = [solve(outs, replace(of, integrators=1), fitted.best.theta, rounds=2)]
    found, *_ = chosen(WeightedMatrix.of(one, None), outs, begun, "rational", fixed=False)[0]
    assert found.structure == of


def test_errors_of_windows_are_found_in_rows_that_mix_them() -> None:
    """Rows are means of the newest windows; errors of neighbouring lines correlate by 0.6; 20 trials, four sigma."""
    rng, lines, trials = np.random.default_rng(8), 200, 20
    matrix = _rows_of(complex_normal(rng, 1, lines, 1, 1))
    factor = np.linalg.cholesky(0.6 ** np.abs(np.subtract.outer(np.arange(lines), np.arange(lines))))
    beside, powers = [], []
    for _ in range(trials):
        windows = factor @ complex_normal(rng, lines, 12)
        means = [windows[:, max(0, n - 5) : n + 1].mean(axis=1) for n in range(12)]
        found = row_scatter(_rows_of(np.array(means)[:, :, None, None]), np.ones(lines, bool), np.ones((lines, 1, 1)))
        assert len(found) == 11
        beside.append(np.mean(found[:, 1:, 0] * found[:, :-1, 0].conj()).real)
        powers.append(np.mean(np.abs(found) ** 2))
    assert np.allclose(powers, 1.0)
    assert abs(np.mean(beside) - 0.6) < 4 * np.std(beside) / np.sqrt(trials) + 0.05  # of 11 vectors at right angles
    assert not len(row_scatter(matrix, np.ones(lines, bool), np.ones((lines, 1, 1))))


def _rows_of(value: np.ndarray) -> MatrixResponses:
    """Rows of one entry, a period after each other."""
    rows, count = value.shape[:2]
    lines = Lines.parse(f"10:{10 * count}:10", rate_hz=5000, window=500)
    unit, sample = np.ones((rows, count, 1, 1), dtype=np.complex128), 500 * np.arange(1, rows + 1)
    return MatrixResponses(
        lines, ("y",), ("u",), value, unit, unit, np.full(rows, 9.0), unit[..., 0].real, unit[..., 0, 0].real,
        np.zeros((rows, count, 1), dtype=np.int8), sample - 499, sample, sample / 5000,
    )  # fmt: skip


@pytest.mark.parametrize(("share", "low", "high"), [(0.0, 1.05, 1.4), (0.5, 0.7, 0.95)])
def test_bounds_follow_the_place_where_the_excitation_begins(share: float, low: float, high: float) -> None:
    """Leakage of the yaw mode adds to the scatter of its stiffness, or lowers it; the study measures by how much."""
    alone, alike = begun(10, share)
    assert low < alone / alike < high


def test_a_model_that_lacks_something_has_an_epsilon(healthy: list[MatrixResponses]) -> None:
    found = fit_matrix(healthy[0], order=3)
    assert (found.epsilon > 0.01).all()


@pytest.mark.parametrize(("outputs", "inputs", "dof", "lines"), [(2, 2, 20, 30), (3, 2, 6, 5), (1, 1, 4, 3)])
def test_the_tail_of_wilks_is_that_of_many_trials(outputs: int, inputs: int, dof: int, lines: int) -> None:
    """4,000 trials of complex Gaussian matrices with their own noise, correlated; four deviations of the binomial."""
    rng, trials = np.random.default_rng(3), 4000
    mixed = complex_normal(rng, outputs, outputs)
    scatter = mixed @ complex_normal(rng, trials * lines, outputs, dof)
    error = mixed @ complex_normal(rng, trials * lines, outputs, inputs)
    inner = np.linalg.solve(scatter @ scatter.conj().swapaxes(1, 2), error @ error.conj().swapaxes(1, 2))
    total = np.linalg.slogdet(np.eye(outputs) + inner)[1].reshape(trials, lines).sum(axis=1)
    for alpha in (0.3, 0.05, 0.01):
        chance = tail(float(np.quantile(total, 1 - alpha)), lines, outputs, inputs, float(dof))
        assert abs(chance - alpha) < 4 * np.sqrt(alpha * (1 - alpha) / trials)


@pytest.mark.parametrize(
    ("part", "field", "factor"),
    [
        ("left belt's stiffness", "stiffness_n_per_m", 0.98),
        ("right belt's stiffness", "right_stiffness_n_per_m", 0.98),
        ("beam's inertia", "beam_inertia_kg_m2", 1.02),
        ("cart's mass", "cart_kg", 1.06),
    ],
)
def test_the_part_that_changed_is_named(healthy: list[MatrixResponses], part: str, field: str, factor: float) -> None:
    truth = getattr(GANTRY, field) * (factor - 1)
    for before, after in zip(healthy, changed(**{field: getattr(GANTRY, field) * factor})):
        found = compare_gantries(before, after, GANTRY)
        assert found.changed
        assert found.causes[0].part == part
        assert abs(found.causes[0].amount - truth) < 2.05 * found.causes[0].bound  # 4 sigma
        assert found.sentences[0].startswith(f"{part} is ")
        assert found.sentences[-1].startswith("response velocity")


def test_a_cart_at_another_place_is_no_fault_of_the_machine(healthy: list[MatrixResponses]) -> None:
    for before, after in zip(healthy, changed(cart_m=0.3)):
        found = compare_gantries(before, after, GANTRY)
        assert found.moved
        assert abs(found.causes[0].amount - 0.1) < 0.003
        assert found.changed or "compare at the same place" in found.sentences[0]
        assert not compare_gantries(before, after, GANTRY, cart_m=(0.2, 0.3), alpha=1e-3).changed


def test_without_a_description_the_entry_and_its_line_are_named(healthy: list[MatrixResponses]) -> None:
    found = compare_matrices(healthy[0], changed(stiffness_n_per_m=0.98 * 4e5)[0])
    assert found.changed
    assert found.sentence.startswith("response velocity1/u1 changed at 5")
    assert not compare_matrices(healthy[0], healthy[1], alpha=1e-4).changed


def test_a_monitor_reports_a_change_once_and_not_before() -> None:
    """The left belt loses 5 %; judged cycle by cycle, without `average`, against a baseline of seven cycles."""
    rng = np.random.default_rng(5)
    w = np.tile(EXCITATION.samples, 14)
    noise = 0.05 * rng.standard_normal((3, w.shape[1]))
    settings = MatrixSettings(
        lines=LINES, output=["velocity1", "velocity2"], input=["u1", "u2"], excitation=["w1", "w2"], hop=400, **PERIODS
    )
    streams = []
    for gantry in (GANTRY, replace(GANTRY, stiffness_n_per_m=0.95 * 4e5)):
        streams.append(
            MatrixTracker(settings).process(GantryLoop(gantry=gantry, rate_hz=RATE_HZ).simulate(w, noise=noise))
        )
        noise = 0.05 * rng.standard_normal((3, w.shape[1]))
    monitor = MatrixMonitor(streams[0][:14], description=GANTRY)
    assert monitor.process(streams[0][14:]) == []
    assert not monitor.alarmed
    fresh = MatrixMonitor(streams[0][:14], description=GANTRY)
    alarms = fresh.process(streams[1])
    assert [alarm.kind for alarm in alarms] == ["change"]
    assert fresh.alarmed
    change = alarms[0].details["changes"][0]
    assert change["name"] == "left belt's stiffness"
    assert abs(change["amount"] + 5) < 2.05 * change["bound"]  # 4 sigma, %
    assert alarms[0].message.startswith("Since 8.8 s the left belt's stiffness is ")


def test_the_mean_uses_rows_that_share_no_window(healthy: list[MatrixResponses]) -> None:
    rows = MatrixResponses.join(
        [
            replace(one[-1:], first=one.first[-1:] + 10**6 * i, sample=one.sample[-1:] + 10**6 * i)
            for i, one in enumerate(healthy[:3])
        ]
    )
    mean = mean_matrix(rows)
    # All have as many repetitions, so that the weights differ only by the noise of the inputs.
    assert np.allclose(mean.value[0], rows.value.mean(axis=0), rtol=0, atol=0.01 * rows.sigma.max())
    noise, spread = np.einsum("rkoo->rko", rows.noise).real, np.einsum("rkii->rki", rows.spread).real
    expected = noise.mean(axis=0)[:, :, np.newaxis] * spread.mean(axis=0)[:, np.newaxis] / 3
    assert np.allclose(mean.sigma[0] ** 2, expected, rtol=0.01)
    same = MatrixResponses.join(healthy[:2])
    assert np.array_equal(mean_matrix(same).value, healthy[1].value[-1:])


def test_what_cannot_be_fitted_or_compared_is_refused(healthy: list[MatrixResponses]) -> None:
    few = replace(healthy[0][-1:], dof=np.array([3.0]))
    with pytest.raises(FitError, match="3 degrees of freedom, but the covariance of 2 outputs needs more than 3"):
        fit_matrix(few)
    with pytest.raises(FitError, match="no matrix has a valid column"):
        mean_matrix(replace(healthy[0][-1:], dof=np.array([np.nan])))
    with pytest.raises(GridError, match="different lines or signals"):
        compare_matrices(healthy[0], replace(healthy[0], inputs=("a", "b")))
    with pytest.raises(UsageError, match="1 outputs and 2 inputs, but a gantry"):
        fit_gantry(healthy[0].transformed([[1.0, 0.0]], np.eye(2), (("a",), ("u1", "u2"))), GANTRY)
    with pytest.raises(UsageError, match="false_alarm_interval_s=0 is not above 0"):
        MatrixMonitor(healthy[0], false_alarm_interval_s=0)
    with pytest.raises(UsageError, match="no parameter 'mass'"):
        fit_gantry(healthy[0], GANTRY)["mass"]


def test_a_described_gantry_is_read_from_its_file(tmp_path: Path) -> None:
    path = tmp_path / "gantry.toml"
    lines = [f"{name} = {value}" for name, value in vars(GANTRY).items()]
    path.write_text("\n".join(lines))
    assert read_gantry(path) == GANTRY
    path.write_text("\n".join([*lines, "cart_g = 3"]))
    with pytest.raises(UsageError, match="a gantry has no parameter 'cart_g'"):
        read_gantry(path)
    path.write_text('cart_kg = "heavy"')
    with pytest.raises(UsageError, match="cart_kg = 'heavy' is not a number"):
        read_gantry(path)
    path.write_text("cart_kg = 6")
    with pytest.raises(UsageError, match="lacks 11 parameters of the gantry"):
        read_gantry(path)
