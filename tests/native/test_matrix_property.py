"""The matrix stage in C gives the bits of its NumPy twin with every instruction set, however the rows are cut."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.kernel import (
    MatrixHistory,
    MatrixRows,
    MatrixStage,
    MatrixWindows,
    instruction_sets,
    process_matrices,
)
from tests.twins import matrices as matrix_twin


@dataclass(frozen=True)
class Case:
    """Sizes, settings, and what the spectra are like."""

    stage: MatrixStage
    pieces: tuple[int, ...]
    spectra: str
    clean: float
    seed: int

    def windows(self) -> MatrixWindows:
        """All rows of the case: the experiments repeat, with noise."""
        s, rng = self.stage, np.random.default_rng(self.seed)
        rows, signals = sum(self.pieces), s.outputs + s.inputs + s.beside
        once = rng.standard_normal((signals, s.experiments * s.places, s.lines + 1, 2)) @ [1, 1j]
        if self.spectra == "zero":
            once[s.outputs :] = 0
        spectrum = np.tile(once, (1, 1 + rows // once.shape[1], 1))[:, :rows]
        if self.spectra == "noise":
            spectrum = spectrum + 0.01 * rng.standard_normal((*spectrum.shape, 2)) @ [1, 1j]
        return MatrixWindows(0, np.ascontiguousarray(spectrum), np.arange(rows), rng.random(rows) < self.clean)


stages = st.builds(
    MatrixStage,
    outputs=st.integers(1, 4),
    inputs=st.integers(1, 4),
    lines=st.sampled_from([1, 2, 3, 8, 9, 13]),
    beside=st.integers(0, 1),
    experiments=st.integers(1, 9),
    repetitions=st.integers(1, 4),
    places=st.integers(1, 3),
    average=st.booleans(),
    means=st.booleans(),
    condition_max=st.just(1e3),
    instruction_set=st.integers(0, len(instruction_sets())),
)
cases = st.builds(
    Case,
    stage=stages,
    pieces=st.lists(st.integers(0, 40), min_size=1, max_size=4).map(tuple),
    spectra=st.sampled_from(["noise", "noise", "exact", "zero"]),
    clean=st.sampled_from([1.0, 0.95]),
    seed=st.integers(0, 2**32 - 1),
)


def processed(stage: MatrixStage, history: MatrixHistory, windows: MatrixWindows) -> MatrixRows:
    found = MatrixRows.empty(stage, len(windows.row))
    process_matrices(stage, history, windows, found)
    return found


def bits_of(array: np.ndarray) -> np.ndarray:
    """Of numbers; one value for all NaN."""
    found = array.view(np.float64) if array.dtype.kind == "c" else array
    return np.where(np.isnan(found), np.nan, found).view(np.int64) if found.dtype.kind == "f" else found


def assert_same_bits(one: tuple, other: tuple) -> None:
    for name, a, b in zip(one._fields, one, other):
        assert np.array_equal(bits_of(a), bits_of(b)), name


@settings(max_examples=80, deadline=None)
@given(cases)
def test_matrices_have_the_bits_of_the_twin_however_the_rows_are_cut(case: Case) -> None:
    whole, stage = case.windows(), case.stage
    history, of_twin = (MatrixHistory.empty(stage, 160) for _ in range(2))
    expected = MatrixRows.empty(stage, len(whole.row))
    matrix_twin.process_matrices(stage, of_twin, whole, expected)
    parts, begin = [], 0
    for rows in case.pieces:
        part = MatrixWindows(
            begin % len(history.complete), whole.spectrum, whole.row[begin : begin + rows], whole.clean
        )
        parts.append(processed(stage, history, part))
        begin += rows
    assert_same_bits(MatrixRows(*map(np.concatenate, zip(*parts))), expected)
    assert np.array_equal(history.spectrum, of_twin.spectrum)
    assert np.array_equal(history.complete, of_twin.complete)


def test_all_instruction_sets_give_the_same_bits_at_eight_inputs() -> None:
    found = []
    for number in range(1, len(instruction_sets()) + 1):
        stage = MatrixStage(8, 8, 21, 0, 8, 3, 2, False, False, 1e3, number)
        windows = Case(stage, (60,), "noise", 1.0, 1).windows()
        found.append(processed(stage, MatrixHistory.empty(stage, 60), windows))
    assert found[0].sure[-1].sum() > 10
    for other in found[1:]:
        assert_same_bits(found[0], other)


@pytest.mark.parametrize(
    "change", [{"outputs": 9}, {"inputs": 0}, {"experiments": 0}, {"repetitions": 30}, {"instruction_set": 9}]
)
def test_sizes_that_do_not_fit_are_refused(change: dict[str, int]) -> None:
    stage = MatrixStage(2, 2, 3, 0, 2, 2, 2, False, False, 1e3, 0)
    windows = Case(stage, (10,), "noise", 1.0, 1).windows()
    with pytest.raises(ValueError, match=r"refused|shape"):
        processed(stage._replace(**change), MatrixHistory.empty(stage, 10), windows)
    with pytest.raises(ValueError, match="refused"):
        processed(stage, MatrixHistory.empty(stage, 9), windows)
    with pytest.raises(ValueError, match="refused"):
        processed(stage, MatrixHistory.empty(stage, 10), windows._replace(row=windows.row + 1))
