"""The pictures of a matrix run: every entry with its bound, invalid lines shaded, and the same bytes each time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from livebode.core import MatrixResponses
from livebode.pictures import Figure, Note, Shade, Trace, matrix_figure, save_matrix_pictures, singular_values_figure
from livebode_matrix import example_matrix_responses

NEWEST = example_matrix_responses()[-1:]


def _invalid(column: int, reason: int) -> MatrixResponses:
    """The newest matrix with one column invalid at all lines."""
    reasons, value = NEWEST.reason.copy(), NEWEST.value.copy()
    reasons[:, :, column], value[..., column] = reason, np.nan
    return replace(NEWEST, reason=reasons, value=value)


def _notes(figure: Figure) -> list[str]:
    return [mark.text for panel in figure.panels for mark in panel.marks if isinstance(mark, Note)]


def _shaded(figure: Figure) -> list[int]:
    return [len(mark.low) for panel in figure.panels for mark in panel.marks if isinstance(mark, Shade)]


def test_the_same_matrix_gives_the_same_bytes(tmp_path: Path) -> None:
    before = [path.read_bytes() for path in save_matrix_pictures(NEWEST, tmp_path, title="gantry")]
    paths = save_matrix_pictures(NEWEST, tmp_path, title="gantry")
    assert [path.name for path in paths] == ["bode.svg", "singular-values.svg"]
    assert [path.read_bytes() for path in paths] == before


def test_each_entry_is_drawn_in_decibels() -> None:
    figure = matrix_figure(NEWEST)
    magnitudes = [panel for panel in figure.panels if panel.title]
    assert [panel.title for panel in magnitudes] == [f"{i} → {o}" for o in NEWEST.outputs for i in NEWEST.inputs]
    for panel, (o, i) in zip(magnitudes, np.ndindex(2, 2)):
        (found, *_) = (mark for mark in panel.marks if isinstance(mark, Trace))
        assert np.allclose(found.y, 20 * np.log10(np.abs(NEWEST.value[0, :, o, i])))
    assert not any(_shaded(figure))


def test_singular_values_are_those_of_the_matrices() -> None:
    (panel,) = singular_values_figure(NEWEST).panels
    drawn = [mark.y for mark in panel.marks if isinstance(mark, Trace)]
    expected = 20 * np.log10(np.linalg.svd(NEWEST.value[0], compute_uv=False))
    assert np.allclose(np.array(drawn).T, expected)
    assert [(end.text, end.value) for end in panel.ends] == [
        (f"σ{i + 1}", pytest.approx(value)) for i, value in enumerate(expected[-1])
    ]


def test_invalid_columns_are_shaded_with_their_reason() -> None:
    found, lines = _invalid(1, reason=3), len(NEWEST.lines)
    figure = matrix_figure(found)
    assert sorted(_shaded(figure)) == [0] * 4 + [lines] * 4
    assert _notes(figure).count("not valid: not separated") == 2
    assert "no line where all columns are valid" in _notes(singular_values_figure(found))


def test_units_are_those_of_the_entries() -> None:
    mixed = replace(NEWEST, units=(("m/A", "m/N"), ("rad/A", "m/N")))
    labels = [panel.y.label for panel in matrix_figure(mixed).panels if panel.title]
    assert labels == [f"dB re 1 {unit}" for row in mixed.units for unit in row]
    assert singular_values_figure(mixed).panels[0].y.label == "singular value in dB (entries have different units)"


def test_one_line_and_one_input_are_drawn(tmp_path: Path) -> None:
    one = NEWEST.sel(input=0, frequency_hz=[NEWEST.frequency_hz[0]])
    assert all(path.stat().st_size > 1000 for path in save_matrix_pictures(one, tmp_path))
