"""Access to a response by frequency, its conversions and descriptions, compared with NumPy, xarray and pandas."""

from __future__ import annotations

import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from livebode import GridError, Lines, Response, Responses, UsageError
from livebode.core import ExtraError
from tests.support.errors import refused
from tests.support.responses import any_responses, made

LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)
SOME = settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@SOME
@given(any_responses())
def test_a_call_gives_the_value_at_each_line_for_one_and_for_many(responses: Responses) -> None:
    for i, f in enumerate(responses.frequency_hz):
        np.testing.assert_array_equal(responses(f), responses.value[:, i])
        for one in responses:
            np.testing.assert_array_equal(one(float(f)), one.value[i])
    np.testing.assert_array_equal(responses(responses.frequency_hz[::-1]), responses.value[:, ::-1])


@SOME
@given(any_responses(), st.floats(0.1, 5000))
def test_a_call_between_the_lines_is_an_error_with_the_nearest_ones(responses: Responses, f: float) -> None:
    away = np.abs(responses.frequency_hz - f) / responses.lines.resolution_hz
    if away.min() < 2e-6:
        return
    with pytest.raises(GridError, match="not interpolated") as caught:
        responses([f, responses.frequency_hz[0]])
    nearest = caught.value.nearest_hz
    assert caught.value.code == "grid.line-off"
    assert nearest[int(np.argmin(np.abs(np.array(nearest) - f)))] == responses.frequency_hz[np.argmin(away)]
    assert len(nearest) == min(2, len(responses.lines))


@SOME
@given(any_responses(), st.data())
def test_sel_is_that_of_xarray(responses: Responses, data: st.DataObject) -> None:
    ends = st.one_of(st.none(), st.sampled_from([float(f) for f in responses.frequency_hz]))
    low, high = data.draw(ends), data.draw(ends)
    if low is not None and high is not None:
        low, high = sorted((low, high))
    times = slice(float(responses.time_s[0]), float(responses.time_s[len(responses) // 2]))
    found = responses.sel(frequency_hz=slice(low, high), time_s=times).to_xarray()
    expected = responses.to_xarray().sel(time_s=times)
    # xarray compares floats exactly; ends that are lines are within both.
    expected = expected.sel(frequency_hz=slice(low, high))
    assert found.identical(expected)


def test_sel_takes_a_list_of_lines_in_any_order_and_keeps_what_belongs_to_them() -> None:
    response = made(3, LINES, hole=0.0)[1]
    found = response.sel(frequency_hz=[120, 40])
    assert isinstance(found, Response)
    assert found.frequency_hz.tolist() == [40, 120]
    np.testing.assert_array_equal(found.value, response.value[[1, 5]])
    np.testing.assert_array_equal(found.bound(2), response.bound(2)[[1, 5]])
    # A line that was left out is not a detection line: it was excited.
    assert set(found.lines.quiet) == {k for k in LINES.quiet if 4 < k < 12}


@pytest.mark.parametrize(
    ("frequency_hz", "kind", "code"),
    [
        (slice(41, 59), GridError, "band-without-line"),
        (slice(80, 40), GridError, "band-without-line"),
        (slice(20, 80, 2), UsageError, "out-of-range"),
        ([20, 50], GridError, "line-off"),
    ],
)
def test_sel_without_a_line_is_an_error(frequency_hz: object, kind: type[Exception], code: str) -> None:
    with refused(kind, code):
        made(3, LINES).sel(frequency_hz=frequency_hz)


def test_sel_of_times_takes_a_slice_by_value() -> None:
    responses = made(9, LINES)
    assert len(responses.sel(time_s=slice(None, responses.time_s[3]))) == 4
    with pytest.raises(TypeError, match="is not a slice"):
        responses.sel(time_s=0.05)
    with refused(UsageError, "out-of-range", argument="time_s"):
        responses.sel(time_s=slice(0, 1, 0.1))


@SOME
@given(any_responses())
def test_a_frame_has_the_numbers_of_the_dataset(responses: Responses) -> None:
    frame, dataset = responses.to_pandas(), responses.to_xarray()
    for name in ("response", "sigma", "coherence", "valid"):
        np.testing.assert_array_equal(frame[name].to_numpy().reshape(responses.value.shape), dataset[name])
    with np.errstate(divide="ignore", invalid="ignore"):
        decibels, degrees = 20 * np.log10(np.abs(responses.value)), np.degrees(np.angle(responses.value))
    np.testing.assert_array_equal(frame["magnitude_db"], decibels.ravel())
    np.testing.assert_array_equal(frame["phase_deg"], degrees.ravel())
    assert frame.attrs["units"]["sigma"] == responses.unit
    one = responses[-1].to_pandas()
    assert one.index.name == "frequency_hz"
    assert one.equals(frame.tail(len(responses.lines)).droplevel("time_s"))
    assert responses[-1].to_xarray()["response"].dims == ("frequency_hz",)


@pytest.mark.parametrize(
    ("package", "convert"), [("xarray", "to_xarray"), ("pandas", "to_pandas"), ("control", "to_frd")]
)
def test_a_conversion_without_its_package_names_the_extra(
    monkeypatch: pytest.MonkeyPatch, package: str, convert: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with refused(ExtraError, "not-installed", extra=package):
        getattr(made(2, LINES)[0], convert)()


@SOME
@given(any_responses())
def test_descriptions_are_short_and_safe(responses: Responses) -> None:
    for thing in (responses, responses[0], responses[:0]):
        assert len(repr(thing)) < 160
        assert "\n" not in repr(thing)
        ElementTree.fromstring(f"<body>{thing._repr_html_()}</body>")


def test_a_table_of_many_lines_is_thinned_and_of_invalid_ones_grey() -> None:
    page = made(1, Lines.of_bins(list(range(1, 101)), 400, 4000.0), hole=0.5)[0]._repr_html_()
    assert "24 of 100 lines" in page
    assert page.count("<tr") == 25
    assert "opacity" in page
