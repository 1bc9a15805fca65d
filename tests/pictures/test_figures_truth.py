"""What is in the pictures is what was measured: read back from their marks and the terminal's characters."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from livebode.cli.pictures import tracked_amount
from livebode.core import CIRCLE_FACTOR, COVERAGE, Lines, Responses
from livebode.pictures import (
    Bars,
    Cells,
    bode_figure,
    quantiles,
    spread,
    terminal_bode,
    tracking_figure,
    unwrapped,
    with_holes,
)
from livebode.pictures.tracking import is_falling
from livebode.preparation import ChannelCheck
from livebode.runtime.run_counts import RunCounts

LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)


def resonant(lines: Lines = LINES, rows: int = 41, peak_hz: float = 60.0) -> Responses:
    """A mass on a spring, 10 % stiffer and softer in turn, with a bound of a tenth of the response."""
    f = lines.frequency_hz
    stiffer = 1 + 0.1 * np.sin(np.arange(rows))[:, np.newaxis]
    value = 3.0 / (1 - (f / peak_hz) ** 2 / stiffer + 0.1j * f / peak_hz)
    number = np.arange(rows) * 20 + 400
    position = 1 - np.abs(1 - np.arange(rows) / 10 % 2)
    return Responses(
        lines, value, 0.02 * np.abs(value), np.full(rows, np.inf), np.full(value.shape, 0.9),
        np.ones(value.shape, dtype=bool), number - 400, number, number / 4000.0, position, "plant", "rad/N",
    )  # fmt: skip


def drawn(panel, name: str) -> list:
    return [mark for mark in panel.marks if getattr(mark, "name", "") == name]


def test_the_bode_plot_draws_medians_and_the_newest_in_decibels_and_degrees() -> None:
    run = resonant()
    magnitude, phase, coherence = bode_figure(run).panels
    size_db = 20 * np.log10(np.abs(run.value))
    np.testing.assert_allclose(drawn(magnitude, "median")[0].x, LINES.frequency_hz)
    np.testing.assert_allclose(drawn(magnitude, "median")[0].y, np.median(size_db, axis=0))
    np.testing.assert_allclose(drawn(magnitude, "newest")[0].y, size_db[-1])
    angle_deg = np.degrees(np.angle(run.value))  # −180 … 0 here, so the plain median is the circular one
    np.testing.assert_allclose(drawn(phase, "median")[0].y, np.median(angle_deg, axis=0))
    np.testing.assert_allclose(drawn(phase, "newest")[0].y, angle_deg[-1])
    np.testing.assert_allclose(drawn(coherence, "median")[0].y, 0.9)
    assert "dB re 1 rad/N" in magnitude.y.label


def test_the_bars_reach_as_far_as_the_bound_of_the_stated_probability() -> None:
    assert pytest.approx(COVERAGE) == 1 - np.exp(-(CIRCLE_FACTOR**2))
    run = resonant()
    magnitude, phase, _ = bode_figure(run).panels
    newest, radius = np.abs(run.value[-1]), run[len(run) - 1].bound()
    (bars,), (turns,) = drawn(magnitude, "bound"), drawn(phase, "bound")
    np.testing.assert_allclose(bars.low, 20 * np.log10(newest - radius))
    np.testing.assert_allclose(bars.high, 20 * np.log10(newest + radius))
    np.testing.assert_allclose((turns.high - turns.low) / 2, np.degrees(np.arcsin(radius / newest)))
    assert isinstance(bars, Bars)


def test_rows_that_are_not_valid_change_nothing() -> None:
    run = resonant()
    bad = np.zeros(run.valid.shape, dtype=bool)
    bad[30:] = True
    spoilt = replace(run, value=np.where(bad, 1e9, run.value), valid=~bad)
    for one, other in zip(bode_figure(spoilt).panels, bode_figure(run[:30]).panels):
        for name in ("median", "newest"):
            np.testing.assert_array_equal(drawn(one, name)[0].y, drawn(other, name)[0].y)


def test_frequencies_are_plain_numbers() -> None:
    for lines, expected in (
        (LINES, ["20", "40", "60", "80", "100", "120", "140"]),
        (Lines.parse("10:600:2.5", rate_hz=4000, window=1600), ["10", "20", "50", "100", "200", "500"]),
    ):
        upper, *_, lowest = bode_figure(resonant(lines)).panels
        assert list(lowest.x.texts) == expected
        assert not upper.x.texts


def test_the_phase_is_unwrapped_and_lines_drowned_in_noise_do_not_wind_it_up() -> None:
    delay_deg = -np.arange(0, 900, 30.0)
    wrapped = (delay_deg + 180) % 360 - 180
    strong = np.zeros(30, dtype=bool)
    out = unwrapped(wrapped, strong)
    np.testing.assert_allclose(np.diff(out), -30.0)
    weak = strong.copy()
    weak[10:14] = True
    noisy = np.where(weak, [170.0, -100.0, 80.0] * 10, wrapped)
    np.testing.assert_allclose(unwrapped(noisy, weak)[~weak], out[~weak])


def test_the_median_phase_around_half_a_turn_is_not_zero() -> None:
    angle_deg = -180 + 10 * np.sin(np.arange(41))[:, np.newaxis] * np.ones(7)
    phase = bode_figure(replace(resonant(), value=np.exp(1j * np.radians(angle_deg)))).panels[1]
    np.testing.assert_allclose(drawn(phase, "median")[0].y, np.median(angle_deg))


def test_quantiles_are_numpys_without_the_holes() -> None:
    values = np.random.default_rng(1).normal(size=(50, 4))
    values[::3, 1] = np.nan
    values[1:, 2] = np.nan
    np.testing.assert_allclose(quantiles(values), np.nanquantile(values, [0.05, 0.5, 0.95], axis=0))


def test_tracking_draws_each_line_against_time_with_gaps_and_its_bound() -> None:
    run = resonant()
    valid = run.valid.copy()
    valid[10:15, 2] = False
    (panel,) = tracking_figure(replace(run, valid=valid, schedule=np.full(41, np.nan))).panels
    traces, bands = drawn(panel, "magnitude"), drawn(panel, "bound")
    expected = np.where(valid, run.magnitude_db, np.nan)
    for i, (trace, band) in enumerate(zip(traces, bands, strict=True)):
        np.testing.assert_allclose(trace.x, run.time_s)
        np.testing.assert_allclose(trace.y, expected[:, i])
        np.testing.assert_allclose(band.low, expected[:, i] + 20 * np.log10(1 - 0.02 * CIRCLE_FACTOR))
        np.testing.assert_allclose(band.high, expected[:, i] + 20 * np.log10(1 + 0.02 * CIRCLE_FACTOR))
    assert [end.text for end in panel.ends] == [f"{f:g} Hz" for f in LINES.frequency_hz]
    np.testing.assert_allclose([end.value for end in panel.ends], expected[-1])


def test_no_trace_is_drawn_across_a_hole_in_time() -> None:
    time_s, (column,) = with_holes(np.array([0.0, 1, 2, 9, 10]), [np.arange(5.0)[:, np.newaxis]])
    np.testing.assert_array_equal(column[:, 0], [0, 1, 2, np.nan, 3, 4])
    assert len(time_s) == 6


def test_forward_and_return_strokes_have_their_own_curves() -> None:
    run = resonant()
    place = tracking_figure(run, schedule_name="position in m").panels[0]
    assert place.x.label == "position in m"
    falling = is_falling(run.schedule)
    np.testing.assert_array_equal(falling[1:9], False)
    np.testing.assert_array_equal(falling[11:19], True)
    np.testing.assert_array_equal(is_falling(np.array([3.0, 3, 2, 2, 5])), [True, True, True, True, False])
    for name, at in (("rising", ~falling), ("falling", falling)):
        np.testing.assert_allclose(drawn(place, name)[1].y, run.magnitude_db[at, 1])


def test_many_lines_become_maps_of_the_same_numbers() -> None:
    run = resonant(Lines.parse("20:120:5", rate_hz=4000, window=800))
    valid = run.valid.copy()
    valid[5:9] = False
    figure = tracking_figure(replace(run, valid=valid, schedule=np.full(41, np.nan)))
    (level,), (change,) = figure.marks("level"), figure.marks("change")
    assert isinstance(level, Cells)
    assert isinstance(change, Cells)
    expected = np.where(valid, run.magnitude_db, np.nan)
    np.testing.assert_allclose(level.values, expected)
    np.testing.assert_allclose(change.values, expected - np.nanmedian(expected, axis=0))


def test_a_plot_of_matplotlib_and_the_picture_of_a_run_show_the_same_numbers() -> None:
    run = resonant()
    axes = run.plot("bode", axes=Figure().subplots(2))
    for plotted, panel in zip(axes, bode_figure(run).panels):
        (newest,) = drawn(panel, "newest")
        (curve,) = (line for line in plotted.lines if len(line.get_xdata()) == len(LINES))
        np.testing.assert_allclose(curve.get_ydata(), newest.y)
        (bars,) = drawn(panel, "bound")
        ends = np.array([stroke[:, 1] for stroke in plotted.collections[-1].get_segments()])
        np.testing.assert_allclose(ends, np.column_stack([bars.low, bars.high]))


def test_labels_keep_their_distance_and_their_order() -> None:
    expected = np.array([0.5, 0.5, 0.1, 0.52, 0.9])
    placed = spread(expected, 0.1)
    assert np.diff(np.sort(placed)).min() >= 0.1 - 1e-12
    assert placed[2] == pytest.approx(0.1)
    assert placed[3] > placed[1] > placed[0]


@pytest.mark.parametrize(("width", "height"), [(80, 24), (60, 18), (200, 50)])
@pytest.mark.parametrize("peak_hz", [40.0, 100.0])
def test_the_terminal_shows_the_peak_where_it_is(width: int, height: int, peak_hz: float) -> None:
    text = terminal_bode(resonant(peak_hz=peak_hz), width, height, colour=False, unicode=False)
    assert text.isascii()
    rows = text.split("\n")
    assert len(rows) <= height
    assert max(map(len, rows)) <= width
    frame = [i for i, row in enumerate(rows) if "+---" in row]
    magnitude = rows[1 : frame[0]]
    column = next(row.index("o") for row in magnitude if "o" in row)
    numbers = [(match.start(), float(match.group())) for match in re.finditer(r"\d+", rows[frame[0] + 1])]
    ticks = [i for i, letter in enumerate(rows[frame[0]]) if letter == "+"][1 : len(numbers) + 1]
    assert all(0 <= tick - start <= 2 for tick, (start, _) in zip(ticks, numbers))
    assert abs(column - np.interp(np.log(peak_hz), np.log([number for _, number in numbers]), ticks)) <= 1
    dots = [i for row in magnitude for i, letter in enumerate(row) if letter == "o"]
    assert len(dots) >= len(LINES) - 1  # two lines may share a cell
    assert "dB re 1 rad/N" in rows[1]
    assert rows[-1].strip() == "frequency in Hz"


def test_the_terminals_text_is_the_same_each_time_and_colour_only_adds_to_it() -> None:
    plain, coloured = (terminal_bode(resonant(), 90, 30, colour=c) for c in (False, True))
    assert terminal_bode(resonant(), 90, 30, colour=False) == plain
    assert re.sub(r"\x1b\[[0-9;]*m", "", coloured) == plain
    assert "\x1b" not in plain


@pytest.mark.parametrize("seed", range(20))
def test_the_counts_beside_each_other_agree(seed: int) -> None:
    """Responses with a valid and with an invalid line: some have both, and together they are all of them."""
    run, rng = resonant(), np.random.default_rng(seed)
    valid = rng.random(run.valid.shape) < rng.random((len(run), 1))
    valid[: int(rng.integers(3))] = False
    run = replace(run, valid=valid)
    counts = RunCounts(ChannelCheck((), ""), 0.0)
    counts.take(run.valid, 0.0)
    shown = re.search(r"median of (\d+) responses? with a valid line", terminal_bode(run, colour=False))
    assert shown is not None
    with_both = int(np.count_nonzero(valid.any(axis=1) & ~valid.all(axis=1)))
    assert int(shown[1]) + counts.invalid - with_both == counts.responses
    summary = {
        "counts": {"responses": counts.responses, "invalid_responses": counts.invalid, "gaps": 0, "samples": 1},
        "speed": {"recorded_s": 1.0, "run_s": 1.0},
        "found": {"frequency_hz": run.lines.frequency_hz, "hop": 1, "rate_hz": 1.0},
    }
    assert f"{counts.invalid} of them with an invalid line" in tracked_amount(summary)


def test_the_terminal_breaks_the_curve_where_a_line_is_not_valid() -> None:
    run = resonant()
    valid = run.valid.copy()
    valid[:, 3] = False
    rows = terminal_bode(replace(run, valid=valid), colour=False).split("\n")
    bottom = next(i for i, row in enumerate(rows) if "└" in row)
    at = rows[bottom + 1].index("80")
    assert all(row[at] == " " for row in rows[2:bottom])
