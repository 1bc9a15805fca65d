"""Every run gives its pictures: whatever is missing from it, in the same bytes, and small."""

from __future__ import annotations

import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import livebode
from livebode.core import Lines, Responses
from livebode.pictures import (
    Band,
    Dots,
    Figure,
    Panel,
    Scale,
    Trace,
    bode_figure,
    columns,
    matrix_figure,
    save_pictures,
    svg_file,
    terminal_bode,
    tracking_figure,
)
from livebode_matrix import example_matrix_responses
from tests.support.drawn_svg import SVG, checked, paths_of


def some(lines: int = 7, rows: int = 30, schedule: bool = True, seed: int = 0) -> Responses:
    """Responses of random size and phase, with everything known."""
    rng = np.random.default_rng(seed)
    shape = (rows, lines)
    value = (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.arange(1, lines + 1)
    number = np.arange(rows) * 20 + 4000
    where = 1 - np.abs(1 - np.arange(rows) / 10 % 2) if schedule else np.full(rows, np.nan)
    return Responses(
        lines=Lines(tuple(range(2, 2 + lines)), window=2 * lines + 10, rate_hz=4000.0),
        value=value,
        sigma=0.05 * np.abs(value),
        dof=np.full(rows, 5.0),
        coherence=rng.uniform(0.5, 1, shape),
        valid=np.ones(shape, dtype=bool),
        first=number - 4000,
        sample=number,
        time_s=number / 4000.0,
        schedule=where,
        unit="rad/s/(N m)",
    )


@st.composite
def anything(draw: st.DrawFn) -> Responses:
    lines, rows = draw(st.sampled_from([1, 2, 7, 11, 45, 260])), draw(st.sampled_from([0, 1, 2, 17]))
    run = some(lines, rows, schedule=draw(st.booleans()), seed=draw(st.integers(0, 99)))
    rng = np.random.default_rng(draw(st.integers(0, 99)))

    def holed(values: np.ndarray) -> np.ndarray:
        odd = draw(st.sampled_from([np.nan, np.inf, 0.0, 1e300, 1e-300]))
        return np.where(rng.random(values.shape) < draw(st.sampled_from([0.0, 0.3, 1.0])), odd, values)

    return replace(
        run,
        value=holed(run.value),
        sigma=holed(run.sigma),
        coherence=holed(run.coherence),
        schedule=holed(run.schedule),
        dof=np.where(rng.random(rows) < 0.2, draw(st.sampled_from([np.nan, np.inf, 0.5])), run.dof),
        valid=rng.random(run.valid.shape) < draw(st.sampled_from([0.0, 0.1, 0.9, 1.0])),
        time_s=run.time_s + draw(st.sampled_from([0.0, 1.7e9])),
    )


@settings(max_examples=40, deadline=None)
@given(run=anything(), size=st.tuples(st.integers(2, 140), st.integers(1, 50)))
def test_no_run_is_too_odd_to_draw(run: Responses, size: tuple[int, int]) -> None:
    for figure in (bode_figure(run), tracking_figure(run)):
        checked(svg_file(figure))
    text = terminal_bode(run, *size, colour=False)
    assert len(text.split("\n")) <= size[1]
    assert max(map(len, text.split("\n"))) <= size[0]


def test_pictures_are_the_same_bytes_each_time(tmp_path) -> None:
    contents = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        paths = save_pictures(some(), tmp_path / name, title="run", schedule_name="position in m")
        assert [p.name for p in paths] == ["bode.svg", "tracking.svg"]
        contents.append([p.read_bytes() for p in paths])
    assert contents[0] == contents[1]


@pytest.mark.parametrize(
    "title", ["$x_{", "a_b^c$", "line\nbreak\x07", "軸の測定", "x" * 400, "  ", "</text><script>", "W" * 60]
)
def test_titles_and_names_from_data_are_text_and_stay_inside(title: str, tmp_path) -> None:
    save_pictures(some(), tmp_path, title=title, schedule_name=title, names=(title, title))
    for figure in (
        bode_figure(replace(some(), unit="u" * 200), title=title, names=(title, title)),
        tracking_figure(replace(some(11), unit="u" * 200), title=title, schedule_name=title),
        matrix_figure(replace(example_matrix_responses()[-1:], inputs=(title + "1", title + "2")), title=title),
    ):
        root = checked(svg_file(figure))
        for text in root.iter(f"{SVG}text"):
            assert text.text is None or "\n" not in text.text
            room = 18.0 * 0.56 * columns(text.text or "")  # on a telephone
            x, anchor = float(text.get("x", 0)), text.get("text-anchor", "start")
            left = {"start": x, "middle": x - room / 2, "end": x - room}[anchor]
            assert left >= -0.1 * figure.width
            assert left + room <= 1.1 * figure.width


def test_a_picture_of_many_responses_is_small_and_has_what_can_be_seen() -> None:
    """Of 10⁵ points of a trace, the lowest and the highest in each unit of the picture remain."""
    x, rng = np.arange(100_000.0), np.random.default_rng(0)
    y = np.cumsum(rng.normal(size=x.size))
    scales = Scale(0.0, x[-1]), Scale(float(y.min()), float(y.max()))
    marks = (Trace("value", x, y, "#0072b2"), Band("bound", x, y - 3, y + 3, "#0072b2"), Dots("dots", x, y, "#0072b2"))
    for mark in marks:
        panel = Panel(0.0, 0.0, 500.0, 300.0, *scales, [mark])
        text = svg_file(Figure("", (), (), [panel], 300.0))
        assert len(text) < 100_000
        ((_, points),) = paths_of(checked(text), mark.name)
        drawn = np.concatenate(points)
        reach = 3 if isinstance(mark, Band) else 0
        for part in np.array_split(np.arange(x.size), 50):
            inside = (drawn[:, 0] >= part[0] / x[-1] * 5000 - 12) & (drawn[:, 0] <= part[-1] / x[-1] * 5000 + 12)
            ends = (1 - scales[1].share(np.array([y[part].min() - reach, y[part].max() + reach]))) * 3000
            assert drawn[inside, 1].max() >= ends[0] - 12
            assert drawn[inside, 1].min() <= ends[1] + 12


def test_drawing_loads_no_plotting_library(tmp_path) -> None:
    """Neither the pictures of a run nor those of a notebook, and the import least of all."""
    look = (
        "import sys; from livebode import example_responses; from livebode.pictures import save_pictures, picture_html;"
        f"save_pictures(example_responses(), {str(tmp_path)!r}); assert picture_html(example_responses());"
        "print({name for name in sys.modules if name.startswith(('matplotlib', 'PIL', 'scipy'))})"
    )
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_a_picture_that_cannot_be_written_leaves_the_previous_ones(tmp_path: Path) -> None:
    before = [path.read_bytes() for path in save_pictures(some(), tmp_path)]
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(OSError, match="File too large"):
            save_pictures(some(seed=1), tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [path.read_bytes() for path in sorted(tmp_path.iterdir())] == before


def test_the_parts_of_a_bound_are_drawn_within_it_where_more_than_noise_is_known() -> None:
    mean = livebode.example_responses().mean()
    varied = replace(mean, sigma=2 * mean.sigma, variation=np.sqrt(3) * mean.sigma)
    plain, parts = (bode_figure(Responses.of(each), mean=each) for each in (mean, varied))
    names = [[mark.name for mark in figure.panels[0].marks if hasattr(mark, "name")] for figure in (plain, parts)]
    assert ("part" in names[0], names[1].count("part")) == (False, 1)
    assert [entry.text for entry in parts.key][1:] == ["noise", "time variation"]
