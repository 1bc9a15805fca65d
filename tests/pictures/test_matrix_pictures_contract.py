"""The pictures of a matrix run: every entry with its bound, invalid lines shaded, and the same bytes each time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from livebode.core import MatrixResponses
from livebode.pictures import matrix_figure, save_matrix_pictures, singular_values_figure
from livebode_matrix import example_matrix_responses

NEWEST = example_matrix_responses()[-1:]


def _invalid(column: int, reason: int) -> MatrixResponses:
    """The newest matrix with one column invalid at all lines."""
    reasons, value = NEWEST.reason.copy(), NEWEST.value.copy()
    reasons[:, :, column], value[..., column] = reason, np.nan
    return replace(NEWEST, reason=reasons, value=value)


def _texts(figure: Figure) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in (axes.title, axes.yaxis.label, *axes.texts)]


def _shaded(figure: Figure) -> list[int]:
    return [sum(patch.get_gid() == "invalid" for patch in axes.patches) for axes in figure.axes]


@pytest.mark.parametrize("dark", [False, True])
def test_the_same_matrix_gives_the_same_bytes(tmp_path: Path, dark: bool) -> None:
    before = [path.read_bytes() for path in save_matrix_pictures(NEWEST, tmp_path, title="gantry", dark=dark)]
    paths = save_matrix_pictures(NEWEST, tmp_path, title="gantry", dark=dark)
    assert [path.name for path in paths] == ["bode.png", "singular-values.png"]
    assert [path.read_bytes() for path in paths] == before


def test_each_entry_is_drawn_in_decibels() -> None:
    figure = matrix_figure(NEWEST)
    magnitudes = [axes for axes in figure.axes if axes.get_title()]
    titles = [axes.get_title() for axes in magnitudes]
    assert [title.split(",")[0] for title in titles] == [f"{i} → {o}" for o in NEWEST.outputs for i in NEWEST.inputs]
    for axes, (o, i) in zip(magnitudes, np.ndindex(2, 2)):
        found = np.asarray(axes.lines[0].get_ydata())
        assert np.allclose(found, 20 * np.log10(np.abs(NEWEST.value[0, :, o, i])))
    assert not any(_shaded(figure))


def test_singular_values_are_those_of_the_matrices() -> None:
    (axes,) = singular_values_figure(NEWEST).axes
    drawn = {line.get_label(): np.asarray(line.get_ydata()) for line in axes.lines}
    expected = 20 * np.log10(np.linalg.svd(NEWEST.value[0], compute_uv=False))
    assert np.allclose(drawn["σ1"], expected[:, 0])
    assert np.allclose(drawn["σ2"], expected[:, 1])


def test_invalid_columns_are_shaded_with_their_reason() -> None:
    found, lines = _invalid(1, reason=3), len(NEWEST.lines)
    figure = matrix_figure(found)
    assert sorted(_shaded(figure)) == [0] * 4 + [lines] * 4
    assert _texts(figure).count("not valid: not separated") == 2
    assert "no line where all columns are valid" in _texts(singular_values_figure(found))


def test_units_are_at_the_axis_or_where_they_differ_in_the_titles() -> None:
    same = replace(NEWEST, units=(("m/A", "m/A"), ("rad/A", "rad/A")))
    assert "magnitude in dB\nre 1 rad/A" in _texts(matrix_figure(same))
    mixed = replace(NEWEST, units=(("m/A", "m/N"), ("m/A", "m/N")))
    assert f"{NEWEST.inputs[1]} → {NEWEST.outputs[0]}, re 1 m/N" in _texts(matrix_figure(mixed))
    assert "singular value in dB (entries have different units)" in _texts(singular_values_figure(mixed))


def test_one_line_and_one_input_are_drawn(tmp_path: Path) -> None:
    one = NEWEST.sel(input=0, frequency_hz=[NEWEST.frequency_hz[0]])
    assert all(path.stat().st_size > 1000 for path in save_matrix_pictures(one, tmp_path))
