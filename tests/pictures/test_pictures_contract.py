"""Every run gives its pictures: whatever is missing from it, in the same bytes, and without touching the caller."""

from __future__ import annotations

import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg

from livebode.core import Lines, Responses
from livebode.pictures import bode_figure, save_pictures, terminal_bode, tracking_figure


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


@settings(max_examples=15, deadline=None)
@given(
    run=anything(), dark=st.booleans(), few_lines=st.booleans(),
    size=st.tuples(st.integers(2, 140), st.integers(1, 50)),
)  # fmt: skip
def test_no_run_is_too_odd_to_draw(run: Responses, dark: bool, few_lines: bool, size: tuple[int, int]) -> None:
    for figure in (bode_figure(run, dark=dark), tracking_figure(run, dark=dark)):
        if few_lines or len(run.lines) < 20:
            FigureCanvasAgg(figure).draw()
    text = terminal_bode(run, *size, colour=False)
    assert len(text.split("\n")) <= size[1]
    assert max(map(len, text.split("\n"))) <= size[0]


def test_pictures_are_the_same_bytes_each_time_and_differ_between_light_and_dark(tmp_path) -> None:
    contents = []
    for name, dark in (("a", False), ("b", False), ("c", True)):
        (tmp_path / name).mkdir()
        paths = save_pictures(some(), tmp_path / name, title="run", schedule_name="position in m", dark=dark)
        assert [p.name for p in paths] == ["bode.png", "tracking.png"]
        contents.append([p.read_bytes() for p in paths])
    assert contents[0] == contents[1]
    assert all(light != dark for light, dark in zip(contents[0], contents[2]))
    assert all(b"matplotlib" not in picture.lower() for picture in contents[0])


@pytest.mark.parametrize("title", ["$x_{", "a_b^c$", "line\nbreak\x07", "軸の測定", "x" * 400, "  "])
def test_titles_and_names_from_data_are_text_and_stay_inside(title: str, tmp_path) -> None:
    save_pictures(some(), tmp_path, title=title, schedule_name=title, names=(title, title))
    figure = bode_figure(replace(some(), unit="u" * 200), title=title, names=(title, title))
    with pytest.warns(UserWarning, match="Glyph") if title == "軸の測定" else _nothing():
        figure.canvas.draw()
        width, height = figure.canvas.get_width_height()
        for text in [*figure.texts, *(axes.yaxis.label for axes in figure.axes)]:
            box = text.get_window_extent()
            assert box.x0 >= 0
            assert box.y0 >= 0
            assert box.x1 <= width
            assert box.y1 <= height


def _nothing():
    import contextlib

    return contextlib.nullcontext()


def test_the_callers_matplotlib_keeps_its_settings_and_does_not_change_ours(tmp_path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    before = dict(matplotlib.rcParams)
    plain = [p.read_bytes() for p in save_pictures(some(), tmp_path / "a")]
    assert dict(matplotlib.rcParams) == before
    with matplotlib.rc_context({"font.size": 25, "axes.facecolor": "red", "text.color": "green"}):
        assert [p.read_bytes() for p in save_pictures(some(), tmp_path / "b")] == plain


def test_importing_the_pictures_loads_no_plotting_library() -> None:
    look = "import sys, livebode.pictures; print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_drawing_never_imports_pyplot(tmp_path) -> None:
    look = (
        "import sys; from test_pictures_contract import some; from livebode.pictures import save_pictures;"
        f"save_pictures(some(), {str(tmp_path)!r}); print('matplotlib.pyplot' in sys.modules)"
    )
    here = __file__.rsplit("/", 1)[0]
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {here!r}); {look}"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "False"


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
