"""Plots of responses: what is drawn, compared with the numbers, and on whose axes."""

from __future__ import annotations

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import same_color

from livebode import Lines, Response, Responses, UsageError, example_responses
from livebode.core import Quantity
from livebode.pictures import Curve, draw_bode
from tests.support.errors import refused
from tests.support.responses import any_responses, made

KINDS = ("bode", "nyquist", "nichols")
LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)


def one(value: np.ndarray, sigma: float | np.ndarray, quantity: Quantity = "plant", lines: Lines = LINES) -> Response:
    k = len(lines)
    ones = np.ones(k)
    return Response(
        lines, np.asarray(value, complex), sigma * ones, np.inf, ones, ones > 0, 0, 399, 0.05, 0.0, quantity
    )


def polygons(axes: plt.Axes) -> list[np.ndarray]:
    return [
        path.vertices[:-1]
        for found in axes.collections
        if isinstance(found, PolyCollection)
        for path in found.get_paths()
    ]


def test_a_bode_plot_has_the_decibels_the_unwrapped_degrees_and_the_bounds() -> None:
    delay_s = 0.009  # 2.9 degrees for each Hz: 1.2 turns over the lines
    f = LINES.frequency_hz
    response = one(0.5 * np.exp(-2j * np.pi * f * delay_s), 0.05)
    radius = 0.05 * np.sqrt(-np.log(0.05))  # of a normal complex error, |error|²/sigma² is exponential
    magnitude, phase = response.plot()
    np.testing.assert_allclose(magnitude.lines[0].get_ydata(), response.magnitude_db)
    np.testing.assert_allclose(np.diff(phase.lines[1].get_ydata()), -360 * delay_s * 20)
    for axes, low, high in (
        (magnitude, 20 * np.log10(0.5 - radius), 20 * np.log10(0.5 + radius)),
        (phase, -np.degrees(np.arcsin(radius / 0.5)), np.degrees(np.arcsin(radius / 0.5))),
    ):
        (bars,) = [found for found in axes.collections if isinstance(found, LineCollection)]
        ends = np.array([segment[:, 1] for segment in bars.get_segments()])
        middle = 0 if axes is magnitude else np.asarray(axes.lines[1].get_ydata())
        np.testing.assert_allclose(ends[:, 0], low + middle)
        np.testing.assert_allclose(ends[:, 1], high + middle)
    assert magnitude.get_xscale() == phase.get_xscale() == "log"


def test_a_bound_of_the_nyquist_plot_is_the_circle() -> None:
    response = one(np.exp(1j * np.arange(7)), np.linspace(0.01, 0.7, 7))
    axes = response.plot("nyquist", c=1.5)
    for polygon, value, radius in zip(polygons(axes), response.value, response.bound(1.5), strict=True):
        np.testing.assert_allclose(np.abs(polygon @ [1, 1j] - value), radius)
    assert axes.get_aspect() == 1


@settings(max_examples=15, deadline=None)
@given(st.floats(0.01, 5), st.floats(-np.pi, np.pi))
def test_a_bound_of_the_nichols_chart_is_the_image_of_the_circle(radius: float, angle: float) -> None:
    """Each corner maps back to a point of the circle; for a circle around zero the lower corners are far below."""
    value = np.exp(1j * angle)
    figure, axes = plt.subplots()
    response = one(np.full(7, value), radius / 2)
    response.plot("nichols", axes=axes, c=2.0)
    for polygon in polygons(axes):
        back = 10 ** (polygon[:, 1] / 20) * np.exp(1j * np.radians(polygon[:, 0]))
        on_circle = np.isclose(np.abs(back - value), radius, rtol=1e-6)
        if radius < 1:
            assert on_circle.all()
            # The branch of the phase is that of the curve.
            assert abs(np.mean(polygon[:, 0]) - axes.lines[0].get_xdata()[0]) < 90
        else:
            assert on_circle[:-2].all()
            assert (polygon[-2:, 1] < -900).all()
            assert np.ptp(polygon[:, 0]) == pytest.approx(360)
    plt.close(figure)


def test_a_bound_that_contains_zero_does_not_flatten_the_curve() -> None:
    sigma = np.full(7, 0.01)
    sigma[3] = 5.0
    magnitude, phase = one(np.geomspace(1, 0.1, 7), sigma).plot()
    low, high = magnitude.get_ylim()
    assert high - low < 20 * 2
    low, high = phase.get_ylim()
    assert high - low < 360 * 2


def test_the_phase_is_the_same_with_and_without_bounds() -> None:
    value = np.exp(-1j * np.linspace(0.1, 5.0, 7))
    value[3] *= -0.01  # half a turn off, and smaller than its bound
    response = one(value, 0.02)
    phases = [response.plot(bounds=shown)[1].lines[1].get_ydata() for shown in (True, False)]
    np.testing.assert_array_equal(*phases)
    assert np.all(np.diff(np.delete(phases[0], 3)) < 0)


@pytest.mark.parametrize("kind", KINDS)
def test_it_draws_on_the_axes_that_are_given_and_opens_no_figure(kind: str) -> None:
    response = example_responses()[-1]
    figure, panels = plt.subplots(2)
    axes = panels if kind == "bode" else panels[0]
    open_ = plt.get_fignums()
    found = response.plot(kind, axes=axes, label="one", color="C3", bounds=False)
    other = response.plot(kind, axes=axes, label="two")
    assert plt.get_fignums() == open_
    assert list(np.atleast_1d(found)) == list(np.atleast_1d(other)) == list(np.atleast_1d(axes))
    first = panels[0]
    assert first.get_legend() is None
    assert first.get_legend_handles_labels()[1] == ["one", "two", "bound: 95 %"]
    assert same_color(first.lines[0].get_color(), "C3")
    plt.close(figure)


@pytest.mark.parametrize(("kind", "count"), [("bode", 1), ("nyquist", 2), ("nichols", 2)])
def test_axes_that_are_not_as_many_as_the_kind_needs_are_refused(kind: str, count: int) -> None:
    _, axes = plt.subplots(count)
    with refused(UsageError, "wrong-shape", argument="axes"):
        example_responses().plot(kind, axes=axes)


def test_a_kind_that_does_not_exist_is_refused_before_a_figure_opens() -> None:
    with refused(UsageError, "not-one-of", argument="kind"):
        example_responses().plot("bodee")
    assert plt.get_fignums() == []


def test_colours_and_background_are_those_of_the_callers_style() -> None:
    with plt.style.context("dark_background"):
        magnitude, _ = example_responses().plot()
        assert same_color(magnitude.get_facecolor(), "black")
        assert same_color(magnitude.lines[0].get_color(), plt.rcParams["axes.prop_cycle"].by_key()["color"][0])


def test_the_critical_point_is_marked_for_an_open_loop_only() -> None:
    for quantity, marks in (("plant", 0), ("open loop", 1)):
        axes = one(-np.linspace(2, 0.5, 7) * (1 + 0.3j), 0.01, quantity).plot("nyquist")
        assert sum(line.get_marker() == "+" for line in axes.lines) == marks


def test_responses_show_the_newest_valid_one_and_the_range_of_all() -> None:
    responses = made(40, LINES, hole=0.0)
    silent = replace(responses, valid=np.where(np.arange(40)[:, None] < 38, True, False) & responses.valid)
    magnitude, _ = silent.plot()
    np.testing.assert_allclose(magnitude.lines[0].get_ydata(), responses.magnitude_db[37])
    assert "5–95 % of 38 responses" in magnitude.get_legend_handles_labels()[1]
    span = next(found for found in magnitude.collections if found.get_label().startswith("5–95"))
    low = np.quantile(responses.magnitude_db[:38], 0.05, axis=0)
    assert np.isclose(span.get_paths()[0].vertices[:, 1].min(), low.min())


@settings(max_examples=9, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(any_responses(), st.sampled_from(KINDS))
def test_no_response_is_too_odd_to_draw(responses: Responses, kind: str) -> None:
    axes = responses.plot(kind)
    figure = np.atleast_1d(axes)[0].figure
    figure.draw_without_rendering()
    plt.close(figure)


def test_arrays_are_drawn_without_a_response() -> None:
    figure, (magnitude, phase) = plt.subplots(2)
    f = np.array([1.0, 2.0, 4.0])
    draw_bode(magnitude, phase, Curve(f, 1 / (1 + 1j * f), np.full(3, np.nan), "low-pass", ""))
    np.testing.assert_allclose(magnitude.lines[0].get_ydata(), -10 * np.log10(1 + f**2))
    assert [line.get_label() for line in magnitude.lines][:1] == ["low-pass"]
    figure.draw_without_rendering()
