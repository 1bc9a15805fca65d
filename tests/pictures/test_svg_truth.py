"""What a Figure describes is where the SVG draws it: positions, colours and texts, read back from the file."""

from __future__ import annotations

import io
import re
from base64 import b64decode
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from livebode import example_responses
from livebode.language import in_language
from livebode.pictures import (
    DARK,
    LIGHT,
    Areas,
    Band,
    Bars,
    Cells,
    Dots,
    Entry,
    Figure,
    Panel,
    Scale,
    Shade,
    Trace,
    bode_figure,
    svg,
    svg_file,
    tracking_figure,
    value_scale,
)
from tests.support.drawn_svg import SVG, checked, paths_of

WIDTH, HEIGHT = 400.0, 200.0
X, Y = Scale(1.0, 100.0, (1, 10, 100), ("1", "10", "100"), logarithmic=True), Scale(-10.0, 30.0)


def drawn(mark: object, y: Scale = Y) -> list[np.ndarray]:
    """The points of a mark in tenths of a unit."""
    panel = Panel(50.0, 30.0, WIDTH, HEIGHT, X, y, [mark])  # type: ignore[list-item]
    found = paths_of(checked(svg_file(Figure("t", (), (), [panel], 300.0))), "mark")
    return [part for _, parts in found for part in parts]


def at(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The same by the definition of the scales."""
    return np.column_stack([np.log10(x) / 2 * 10 * WIDTH, (30 - y) / 40 * 10 * HEIGHT])


@st.composite
def curves(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    count = draw(st.integers(1, 60))
    rng = np.random.default_rng(draw(st.integers(0, 999)))
    y = rng.uniform(-10, 30, count)
    y[rng.random(count) < draw(st.sampled_from([0.0, 0.3, 0.9]))] = np.nan
    return np.sort(rng.uniform(1, 100, count)), y


@settings(deadline=None)
@given(curve=curves())
def test_a_line_has_its_points_and_is_open_where_nothing_is_known(curve: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = curve
    known = np.isfinite(y)
    parts = drawn(Trace("mark", x, y, "#0072b2"))
    lines = [part for part in parts if len(part) > 1 and np.ptp(part[:, 0] + part[:, 1])]
    every = np.array([point for part in parts for point in np.unique(part, axis=0)]).reshape(-1, 2)
    for point in at(x, y)[known]:
        assert np.abs(every - point).max(axis=1).min() <= 1
    steps = sum(len(part) - 1 for part in lines)
    assert steps == np.count_nonzero(known[1:] & known[:-1])


@settings(deadline=None)
@given(curve=curves())
def test_bars_and_dots_are_at_their_values(curve: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = curve
    known = np.isfinite(y)
    bars = drawn(Bars("mark", x, y - 1, y + 2, "#0072b2"))
    expected = np.stack([at(x, y - 1), at(x, y + 2)], axis=1)[known]
    found = np.array(bars).reshape(-1, 2, 2)
    np.testing.assert_allclose(found, expected[np.argsort(np.rint(expected[:, 0, 0]), kind="stable")], atol=0.51)
    dots = np.array([part[0] for part in drawn(Dots("mark", x, y, "#0072b2"))]).reshape(-1, 2)
    middle = at(x, y)[known]
    np.testing.assert_allclose(dots, middle[np.argsort(np.rint(middle[:, 0]), kind="stable")], atol=0.51)


def test_a_band_is_between_its_ends_and_what_is_far_outside_stays_near() -> None:
    x = np.array([1.0, 10.0, 100.0])
    low, high = np.array([0.0, 5.0, -1000.0]), np.array([1.0, 20.0, 3.0])
    (area,) = drawn(Band("mark", x, low, high, "#0072b2"))
    upper, lower = at(x, high), at(x, low)[::-1]
    lower[0, 1] = 4 * 10 * HEIGHT  # three heights below the panel, in place of 25
    np.testing.assert_allclose(area, np.concatenate([upper, lower]), atol=0.51)


def test_regions_and_shades_are_where_they_are_described() -> None:
    x, y = np.array([1.0, 10.0, 10.0]), np.array([0.0, 0.0, 10.0])
    (area,) = drawn(Areas("mark", [(x, y), (x, y * np.nan)], "#0072b2"))
    np.testing.assert_allclose(area, at(x, y), atol=0.51)
    (shade,) = drawn(Shade("mark", np.array([2.0]), np.array([5.0]), "#0072b2"))
    assert shade[:, 0].min() == pytest.approx(np.log10(2) / 2 * 4000, abs=0.51)
    assert shade[:, 0].max() == pytest.approx(np.log10(5) / 2 * 4000, abs=0.51)
    assert (shade[:, 1].min(), shade[:, 1].max()) == (0, 10 * HEIGHT)


@pytest.mark.parametrize("logarithmic", [False, True])
def test_cells_have_the_colour_of_their_value_and_grey_where_there_is_none(logarithmic: bool) -> None:
    edges = np.array([1.0, 2.0, 10.0, 100.0])
    values = np.array([[0.0, 5.0, 10.0], [np.nan, 10.0, 0.0]])
    y = Scale(1.0, 100.0, logarithmic=logarithmic)
    mark = Cells("mark", (1.0, 100.0), edges, values, (0.0, 10.0))
    panel = Panel(0.0, 0.0, WIDTH, HEIGHT, X, y, [mark])
    (image,) = checked(svg(Figure("", (), (), [panel], 300.0))).iter(f"{SVG}image")
    picture = Image.open(io.BytesIO(b64decode(image.get("href", "").partition(",")[2])))
    rgba = np.asarray(picture.convert("RGBA"))
    assert picture.size == (2, 400)
    for column, row in np.ndindex(2, 3):
        middle = np.sqrt(edges[row] * edges[row + 1]) if logarithmic else (edges[row] + edges[row + 1]) / 2
        colour = rgba[int(len(rgba) * (1 - y.share(middle))), column].astype(int)
        if np.isnan(values[column, row]):
            assert np.ptp(colour[:3]) < 25
            assert colour[3] < 128
            continue
        expected = {0.0: (68, 1, 84), 5.0: (33, 145, 140), 10.0: (253, 231, 37)}[values[column, row]]  # viridis
        assert np.abs(colour[:3] - expected).max() <= 6
        assert colour[3] == 255


def test_every_colour_of_a_picture_has_a_dark_one_and_text_its_contrast() -> None:
    figure = bode_figure(example_responses(), title="t")
    text = svg_file(figure)
    used = set(re.findall(r'(?:fill|stroke)="(#[0-9a-f]{6})"', text.partition("</style>")[2]))
    dark = dict(re.findall(r'\.figure \[fill="(#[0-9a-f]{6})"\]\{fill:(#[0-9a-f]{6})\}', text))
    assert used <= set(dark)
    assert dark[LIGHT.ink] == DARK.ink
    for look in (LIGHT, DARK):
        assert all(contrast(look.paper, colour) > 4.5 for colour in (look.ink, look.muted))


def contrast(one: str, other: str) -> float:
    """As WCAG 2.1 defines it."""
    light = []
    for colour in (one, other):
        rgb = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
        linear = np.where(rgb <= 0.03928, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        light.append(float(linear @ [0.2126, 0.7152, 0.0722]))
    return (max(light) + 0.05) / (min(light) + 0.05)


def test_texts_are_in_the_language_in_use() -> None:
    run = replace(example_responses(), unit="")
    with in_language("de"):
        figures = bode_figure(run), tracking_figure(run)
        words = {text.text for figure in figures for text in checked(svg_file(figure)).iter(f"{SVG}text")}
    assert {"Frequenz in Hz", "Phase in Grad", "Betrag in dB"} <= words
    assert "0,5" in words
    assert not {"frequency in Hz", "phase in degrees", "0.5"} & words


def test_numbers_of_a_scale_are_round_and_within_it() -> None:
    scale = value_scale(-0.0123, 0.0456, "x")
    assert [float(text.replace("−", "-")) for text in scale.texts] == list(scale.ticks)
    assert all(-0.0123 <= tick <= 0.0456 for tick in scale.ticks)
    assert len(scale.ticks) >= 3
    assert value_scale(5.0, 5.0, "x").low < 5.0 < value_scale(5.0, 5.0, "x").high


def test_the_key_names_what_is_drawn_and_never_leaves_the_picture() -> None:
    entries = [Entry(f"curve {i} with a long name", "#0072b2", "line") for i in range(9)]
    root = checked(svg_file(Figure("title", ("a fact", "another"), entries, (), 10.0)))
    texts = [text for text in root.iter(f"{SVG}text") if (text.text or "").startswith("curve")]
    assert [text.text for text in texts] == [entry.text for entry in entries]
    assert max(float(text.get("x", 0)) for text in texts) < 500
    assert len({text.get("y") for text in texts}) > 3
