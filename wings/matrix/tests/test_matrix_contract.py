"""What a MatrixTracker promises of its results, whatever way the samples come, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Block, GridError, Lines, MatrixLoop, MatrixResponses, SignalError, StateError, UsageError
from livebode.excitation import MatrixExcitation
from livebode_matrix import MatrixSettings, MatrixTracker, example_matrix_responses

LINES = Lines.parse("10:40:5", rate_hz=1000, window=200)
NAMES = ("u1", "u2", "y1", "y2", "y3")
GAIN = np.array([[2.0, 1.0], [0.5, 3.0], [1.0, -1.0]])
OPTIONS = {"output": NAMES[2:], "input": NAMES[:2], "estimator": "direct", "hop": 50, "memory": 3}


def block_of(u: np.ndarray, noise: float = 0.0, start: int = 0) -> Block:
    y = GAIN @ u + noise * np.random.default_rng(0).standard_normal((3, u.shape[1]))
    return Block(np.vstack([u, y]), NAMES, rate_hz=1000, start=start)


def tracker(**options: object) -> MatrixTracker:
    return MatrixTracker(MatrixSettings(**({"lines": LINES} | OPTIONS | options)))  # type: ignore[arg-type]


ORTHOGONAL = np.tile(MatrixExcitation.orthogonal(LINES, 2).samples, 4)


@pytest.mark.parametrize("experiments", [None, 1])
@pytest.mark.parametrize("size", [1, 37, 50, 411, 1600])
def test_the_matrices_do_not_depend_on_how_the_samples_are_cut(size: int, experiments: int | None) -> None:
    """With one experiment the inputs do not separate, so the singular values decide."""
    whole = block_of(ORTHOGONAL, noise=0.1)
    expected = tracker(experiments=experiments).process(whole)
    cut = tracker(experiments=experiments)
    found = MatrixResponses.join(
        [cut.process(whole.cut(i, min(i + size, len(whole)))) for i in range(0, len(whole), size)]
    )
    assert found.equals(expected)


def test_a_restored_tracker_continues_exactly_and_refuses_the_state_of_another() -> None:
    whole = block_of(ORTHOGONAL, noise=0.1)
    one = tracker()
    one.process(whole.cut(0, 1333))
    other = tracker()
    other.restore(one.snapshot())
    assert other.process(whole.cut(1333, len(whole))).equals(one.process(whole.cut(1333, len(whole))))
    with pytest.raises(StateError):
        tracker(memory=4).restore(one.snapshot())


def test_every_hop_of_a_periodic_excitation_of_one_input_gives_a_column() -> None:
    u = np.tile(MatrixExcitation.orthogonal(LINES, 1, dwell=1, settle=0).samples, 5)
    block = block_of(np.vstack([u, 0 * u]), noise=0.01)
    found = tracker(input=["u1"]).process(block)
    assert len(found) == 20
    assert found.value.shape == (20, 7, 3, 1)
    assert found.valid[4:].all()
    assert np.allclose(found.value[-1, :, :, 0], GAIN[:, 0], atol=0.01)


def test_a_dwell_that_is_not_that_of_the_recording_makes_the_matrices_invalid() -> None:
    """Both windows are of one experiment, so that the excitations are equal in them, and the inputs differ by noise."""
    w = np.tile(MatrixExcitation.orthogonal(LINES, 2, dwell=8, settle=4).samples, 2)
    u = w + 0.5 * np.random.default_rng(0).standard_normal(w.shape)
    block = Block(np.vstack([w, u, GAIN @ u]), ("w1", "w2", *NAMES), rate_hz=1000)
    found = tracker(estimator="joint", excitation=["w1", "w2"], dwell=2, settle=1, hop=200).process(block)
    assert not found.valid[3].any()
    assert "moves together with others" in found.why(3)[0]


def test_a_gap_makes_matrices_invalid_until_all_experiments_are_complete_again() -> None:
    whole = block_of(ORTHOGONAL)
    one = tracker()
    one.process(whole.cut(0, 1000))
    events: list[object] = []
    found = one.process(whole.cut(1001, len(whole)), events.append)
    assert len(events) == 1
    valid = found.valid.all(axis=(1, 2))
    assert not valid[found.sample < 1600].any()
    assert valid[found.sample >= 2000].all()
    assert "start, a gap" in found.why(0)[0]


def test_inputs_that_move_together_are_invalid_with_the_reason() -> None:
    u = np.tile(MatrixExcitation.orthogonal(LINES, 1, dwell=4, settle=0).samples, 4)
    together = tracker(experiments=2).process(block_of(np.vstack([u, 2 * u]), noise=0.01))
    assert not together.valid.any()
    assert "moves together with others" in together.why()[0]
    assert "7 lines from 10 to 40 Hz" in together.why()[0]
    assert np.isnan(together.value).all()


@pytest.mark.parametrize("condition_max", [1e3, 1e12])
def test_one_experiment_does_not_separate_two_inputs_whatever_the_limit(condition_max: float) -> None:
    found = tracker(experiments=1, condition_max=condition_max).process(block_of(ORTHOGONAL))
    assert not found.valid.any()


def test_noise_on_inputs_that_move_together_does_not_separate_them() -> None:
    u = np.tile(MatrixExcitation.orthogonal(LINES, 1, dwell=4, settle=0).samples, 40)
    noise = 0.02 * np.random.default_rng(1).standard_normal((2, u.shape[1]))
    found = tracker(experiments=2, average=True, memory=8, hop=200).process(block_of(np.vstack([u, u]) + noise))
    assert not found.valid[-20:].any()


def test_an_input_that_is_not_excited_at_a_line_is_invalid_there_and_the_other_column_valid() -> None:
    excitation = MatrixExcitation.interleaved(LINES, 2, dwell=4, settle=0)
    first = np.tile(excitation.samples[:, :800], 4)  # without the change of lines: each line has one input
    found = tracker(experiments=1).process(block_of(first))[-1:]
    assert found.valid[0, ::2].tolist() == [[True, False]] * 4
    assert found.valid[0, 1::2].tolist() == [[False, True]] * 3
    assert np.allclose(found.value[0, ::2, :, 0], GAIN[:, 0])
    assert np.allclose(found.value[0, 1::2, :, 1], GAIN[:, 1])
    assert "the input does not move" in found.why()[0]


def test_excitations_are_orthogonal_or_apart_over_their_experiments() -> None:
    for kind, together in (("orthogonal", True), ("interleaved", False), ("successive", False)):
        made = getattr(MatrixExcitation, kind)(LINES, 3, [1.0, 0.5, 2.0])
        gram = np.einsum("pik,pjk->kij", made.spectra, made.spectra.conj())
        assert np.allclose(gram, np.diag([1.0, 0.25, 4.0]) * (3 if together else 1), atol=1e-12)
        periods = made.samples.reshape(3, 3, 2, 200)  # inputs, experiments, periods
        assert np.array_equal(periods[:, :, 0], periods[:, :, 1])
        found = np.fft.rfft(periods[:, :, 0], axis=2)[:, :, list(LINES.bins)] * 2j / 200
        assert np.allclose(found, made.spectra.transpose(1, 0, 2), atol=1e-12)


def test_an_entry_is_a_response_like_any_other() -> None:
    responses = example_matrix_responses()
    entry = responses.entry("velocity2", "u1")
    assert np.array_equal(entry.value, responses.value[:, :, 1, 0])
    assert np.array_equal(entry.bound(2), responses.bound(2)[:, :, 1, 0])
    variance = np.einsum("rkoioi->rkoi", responses.covariance).real
    assert np.allclose(np.sqrt(variance), responses.sigma)
    assert responses.singular_values.shape == (3, 7, 2)
    assert repr(entry[-1]).startswith("<Response: plant, 7 lines, 10 … 40 Hz, all valid")
    with pytest.raises(UsageError, match="'velocity3' is not one of the outputs"):
        responses.entry("velocity3", 0)
    with pytest.raises(GridError):
        MatrixResponses.join([responses, responses.transformed(np.eye(2), np.eye(2), (("a", "b"), ("c", "d")))])


def test_other_coordinates_have_the_covariance_of_the_same_errors() -> None:
    responses = example_matrix_responses()
    a, b = np.array([[0.5, 0.5], [1.0, -1.0]]), np.array([[1.0, 1.0], [1.0, -1.0]])
    turned = responses.transformed(a, b, (("x", "y"), ("tx", "ty")))
    assert np.allclose(turned.value, a @ responses.value @ b)
    same = np.einsum("ao,ib,rkoipj,cp,jd->rkabcd", a, b, responses.covariance, a, b)
    assert np.allclose(turned.covariance, same)
    with pytest.raises(UsageError, match="do not fit"):
        responses.transformed(a[:, :1], b, (("x", "y"), ("tx", "ty")))


def test_other_libraries_get_the_matrix_with_its_names() -> None:
    responses = example_matrix_responses()
    frd = responses.to_frd()
    assert frd.input_labels == ["u1", "u2"]
    assert np.allclose(np.moveaxis(frd.frdata, 2, 0), responses.value[-1])
    dataset = responses.to_xarray()
    assert dict(dataset.response.sizes) == {"time_s": 3, "frequency_hz": 7, "output": 2, "input": 2}
    assert np.allclose(dataset.response.sel(output="velocity2", input="u1").values, responses.value[:, :, 1, 0])


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"estimator": "welch"}, "estimator='welch' is not supported for several inputs"),
        ({"input": []}, "has 0 input signals"),
        ({"input": [f"u{i}" for i in range(9)]}, "has 9 input signals"),
        ({"estimator": "joint", "excitation": ["w1"]}, "there are 2 inputs, but 1 excitations"),
        ({"input": ["u1", "y1"]}, "channel 'y1' is named for two signals"),
        ({"hop": 30}, "hop=30 does not divide the window of 200 samples; take"),
        ({"dwell": 1, "settle": 1}, "dwell=1 is not from 2"),
        ({"memory": 1}, "memory=1 is not from 2"),
        ({"estimator": "indirect", "excitation": ["w1", "w2"]}, "the loop's feedback is missing"),
        (
            {"estimator": "indirect", "excitation": ["w1", "w2"], "loop": MatrixLoop(feedback=[[1.0, None]])},
            "the feedback is a matrix of 1 × 2",
        ),
    ],
)
def test_settings_that_do_not_fit_are_one_sentence(options: dict[str, object], sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        tracker(**options)


def test_wrong_matrices_limits_and_samples_are_refused() -> None:
    with pytest.raises(UsageError, match="rows of 1, 2 elements"):
        MatrixLoop(feedback=[[1.0], [1.0, None]])
    with pytest.raises(UsageError, match="dwell=1 is below 2"):
        MatrixExcitation.orthogonal(LINES, 2, dwell=1)
    with pytest.raises(UsageError, match=r"amplitude has shape \(3,\)"):
        MatrixExcitation.orthogonal(LINES, 2, [1.0, 2.0, 3.0])
    two = MatrixExcitation.orthogonal(LINES, 2)
    with pytest.raises(UsageError, match="no limit is finite"):
        two.within_limits(lambda f: np.tile(GAIN, (len(f), 1, 1)))
    with pytest.raises(UsageError, match="input_max=0 is not above 0"):
        two.within_limits(lambda f: np.tile(GAIN, (len(f), 1, 1)), input_max=0)
    with pytest.raises(UsageError, match="does not separate"):
        two.scaled([1.0, 0.0]).predict(lambda f: np.tile(GAIN, (len(f), 1, 1)), 0.1)
    with pytest.raises(SignalError, match="the block is empty"):
        tracker().process(block_of(ORTHOGONAL[:, :0]))
    with pytest.raises(SignalError, match="500 samples per second"):
        tracker().process(Block(np.zeros((5, 10)), NAMES, rate_hz=500))


@pytest.mark.parametrize("average", [False, True])
def test_first_is_the_oldest_sample_that_a_matrix_depends_on(average: bool) -> None:
    whole = block_of(ORTHOGONAL, noise=0.1)
    found = tracker(average=average).process(whole)
    valid = np.flatnonzero(found.valid.all(axis=(1, 2)))
    for row in valid[[0, len(valid) // 2, -1]]:
        first, sample = int(found.first[row]), int(found.sample[row])
        for begin, same in ((first, True), (first + 1, False)):
            later = tracker(average=average).process(whole.cut(begin, len(whole)))
            (at,) = np.flatnonzero(later.sample == sample)
            assert np.allclose(later.value[at], found.value[row], rtol=1e-9) == same
            assert (later.first[at] == first) == same
    assert (found.first[valid] >= 0).all()
