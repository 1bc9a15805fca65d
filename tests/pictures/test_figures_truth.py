"""What stands in the pictures is what was measured: read back from the drawn artists and the terminal's characters."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from livebode.cli.pictures import tracked_amount
from livebode.core import CIRCLE_FACTOR, COVERAGE, Lines, Responses
from livebode.pictures import bode_figure, quantiles, spread, terminal_bode, tracking_figure, unwrapped, with_holes
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


def drawn(axes, gid: str) -> list:
    return [artist for artist in axes.get_children() if artist.get_gid() == gid]


def test_the_bode_plot_draws_medians_and_the_newest_in_decibels_and_degrees() -> None:
    run = resonant()
    magnitude, phase, coherence = bode_figure(run).axes
    size_db = 20 * np.log10(np.abs(run.value))
    np.testing.assert_allclose(drawn(magnitude, "median")[0].get_xydata()[:, 0], LINES.frequency_hz)
    np.testing.assert_allclose(drawn(magnitude, "median")[0].get_ydata(), np.median(size_db, axis=0))
    np.testing.assert_allclose(drawn(magnitude, "newest")[0].get_ydata(), size_db[-1])
    angle_deg = np.degrees(np.angle(run.value))  # −180 … 0 here, so the plain median is the circular one
    np.testing.assert_allclose(drawn(phase, "median")[0].get_ydata(), np.median(angle_deg, axis=0))
    np.testing.assert_allclose(drawn(phase, "newest")[0].get_ydata(), angle_deg[-1])
    np.testing.assert_allclose(drawn(coherence, "median")[0].get_ydata(), 0.9)
    assert "dB re 1 rad/N" in magnitude.get_ylabel()


def test_the_bars_reach_as_far_as_the_bound_of_the_stated_probability() -> None:
    assert pytest.approx(COVERAGE) == 1 - np.exp(-(CIRCLE_FACTOR**2))
    run = resonant()
    magnitude, phase, _ = bode_figure(run).axes
    newest, radius = np.abs(run.value[-1]), run[len(run) - 1].bound()
    bars = np.array([bar[:, 1] for bar in drawn(magnitude, "bound")[0].get_segments()])
    np.testing.assert_allclose(bars, 20 * np.log10(np.column_stack([newest - radius, newest + radius])))
    turns = np.array([bar[:, 1] for bar in drawn(phase, "bound")[0].get_segments()])
    np.testing.assert_allclose(np.diff(turns)[:, 0] / 2, np.degrees(np.arcsin(radius / newest)))


def test_rows_that_are_not_valid_change_nothing() -> None:
    run = resonant()
    bad = np.zeros(run.valid.shape, dtype=bool)
    bad[30:] = True
    spoilt = replace(run, value=np.where(bad, 1e9, run.value), valid=~bad)
    for one, other in zip(bode_figure(spoilt).axes, bode_figure(run[:30]).axes):
        for gid in ("median", "newest"):
            np.testing.assert_array_equal(drawn(one, gid)[0].get_xydata(), drawn(other, gid)[0].get_xydata())


def test_frequencies_are_plain_numbers() -> None:
    for lines, expected in (
        (LINES, ["20", "40", "60", "80", "100", "120", "140"]),
        (Lines.parse("10:600:2.5", rate_hz=4000, window=1600), ["10", "20", "50", "100", "200", "500"]),
    ):
        axes = bode_figure(resonant(lines)).axes[-1]
        assert [label.get_text() for label in axes.get_xticklabels()] == expected
        assert [label.get_text() for label in axes.get_xticklabels(minor=True) if label.get_text()] == []


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
    phase = bode_figure(replace(resonant(), value=np.exp(1j * np.radians(angle_deg)))).axes[1]
    np.testing.assert_allclose(drawn(phase, "median")[0].get_ydata(), np.median(angle_deg))


def test_quantiles_are_numpys_without_the_holes() -> None:
    values = np.random.default_rng(1).normal(size=(50, 4))
    values[::3, 1] = np.nan
    values[1:, 2] = np.nan
    np.testing.assert_allclose(quantiles(values), np.nanquantile(values, [0.05, 0.5, 0.95], axis=0))


def test_tracking_draws_each_line_against_time_with_gaps_and_its_bound() -> None:
    run = resonant()
    valid = run.valid.copy()
    valid[10:15, 2] = False
    figure = tracking_figure(replace(run, valid=valid, schedule=np.full(41, np.nan)))
    (axes,) = figure.axes
    traces = drawn(axes, "magnitude")
    expected = np.where(valid, run.magnitude_db, np.nan)
    for i, trace in enumerate(traces):
        np.testing.assert_allclose(trace.get_xdata(), run.time_s)
        np.testing.assert_allclose(trace.get_ydata(), expected[:, i])
    bands = [band.get_datalim(axes.transData) for band in drawn(axes, "bound")]
    for i, band in enumerate(bands):
        assert band.y0 == pytest.approx(np.nanmin(expected[:, i]) + 20 * np.log10(1 - 0.02 * CIRCLE_FACTOR))
        assert band.y1 == pytest.approx(np.nanmax(expected[:, i]) + 20 * np.log10(1 + 0.02 * CIRCLE_FACTOR))
    assert {text.get_text() for text in axes.texts} == {f"{f:g} Hz" for f in LINES.frequency_hz}


def test_no_trace_is_drawn_across_a_hole_in_time() -> None:
    time_s, (column,) = with_holes(np.array([0.0, 1, 2, 9, 10]), [np.arange(5.0)[:, np.newaxis]])
    np.testing.assert_array_equal(column[:, 0], [0, 1, 2, np.nan, 3, 4])
    assert len(time_s) == 6


def test_forward_and_return_strokes_have_their_own_curves() -> None:
    run = resonant()
    figure = tracking_figure(run, schedule_name="position in m")
    place = figure.axes[0]
    assert place.get_xlabel() == "position in m"
    falling = is_falling(run.schedule)
    np.testing.assert_array_equal(falling[1:9], False)
    np.testing.assert_array_equal(falling[11:19], True)
    np.testing.assert_array_equal(is_falling(np.array([3.0, 3, 2, 2, 5])), [True, True, True, True, False])
    for gid, at in (("rising", ~falling), ("falling", falling)):
        np.testing.assert_allclose(drawn(place, gid)[1].get_ydata(), run.magnitude_db[at, 1])


def test_many_lines_become_maps_of_the_same_numbers() -> None:
    run = resonant(Lines.parse("20:120:5", rate_hz=4000, window=800))
    valid = run.valid.copy()
    valid[5:9] = False
    level, change = (
        axes.collections[0].get_array()
        for axes in tracking_figure(replace(run, valid=valid, schedule=np.full(41, np.nan))).axes
        if axes.get_ylabel() == "frequency in Hz"
    )
    expected = np.where(valid, run.magnitude_db, np.nan)
    np.testing.assert_allclose(level.filled(np.nan), expected.T)
    np.testing.assert_allclose(change.filled(np.nan), (expected - np.nanmedian(expected, axis=0)).T)


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
