"""frf and track: every way to give the same signals has the same response, which is that of a run on the same file."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import livebode
from livebode.core import Block, SignalError, SignalWarning, UsageError
from livebode.tables import Table, write_parquet
from tests.support.errors import refused

RATE_HZ = 4000.0
NAMES = {"w": "w [N m]", "u": "u [N m]", "velocity": "velocity [rad/s]"}


@cache
def block() -> Block:
    return livebode.example_axis().run()[0]


def signals() -> list[np.ndarray]:
    return [block()[name] for name in NAMES]


@cache
def expected() -> livebode.Response:
    return livebode.frf(*signals(), fs=RATE_HZ)


def frame():
    import pandas

    index = pandas.date_range("2026-01-01", periods=len(block()), freq="250us")
    return pandas.DataFrame({NAMES[name]: block()[name] for name in NAMES}, index=index)


def of_pandas() -> livebode.Response:
    table = frame()
    return livebode.frf(*(table[name] for name in NAMES.values()))


def of_pandas_with_a_time_zone() -> livebode.Response:
    table = frame().tz_localize("Europe/Vienna")
    return livebode.frf(*(table[name] for name in NAMES.values()))


def of_pandas_with_seconds() -> livebode.Response:
    import pandas

    table = frame().set_index(pandas.Index(np.arange(len(block())) / RATE_HZ, name="t [s]"))
    return livebode.frf(*(table[name] for name in NAMES.values()))


def of_xarray() -> livebode.Response:
    import xarray

    time = ("time", np.arange(len(block())) / RATE_HZ, {"units": "s"})
    units = {"w": "N m", "u": "N m", "velocity": "rad/s"}
    data = {name: ("time", block()[name], {"units": units[name]}) for name in units}
    dataset = xarray.Dataset(data, coords={"time": time})
    return livebode.frf(dataset.w, dataset.u, dataset.velocity)


WAYS: dict[str, Callable[[], livebode.Response]] = {
    "lists": lambda: livebode.frf(*(x.tolist() for x in signals()), fs=RATE_HZ),
    "columns of MATLAB": lambda: livebode.frf(*(x[:, np.newaxis] for x in signals()), fs=4000),
    "rows": lambda: livebode.frf(*(x[np.newaxis] for x in signals()), fs=np.int64(4000)),
    "lines and window given": lambda: livebode.frf(*signals(), fs=RATE_HZ, lines="20:140:10", window=400),
    "lines as numbers": lambda: livebode.frf(*signals(), fs=RATE_HZ, lines=np.arange(20, 141, 10), window=400),
    "a list of one output": lambda: livebode.frf(*signals()[:2], signals()[2:], fs=RATE_HZ)[0],
    "pandas": of_pandas,
    "pandas with a time zone": of_pandas_with_a_time_zone,
    "pandas with seconds": of_pandas_with_seconds,
    "xarray": of_xarray,
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_give_signals_has_the_same_response(way: str) -> None:
    response = WAYS[way]()
    assert response.frequency_hz == pytest.approx(expected().frequency_hz, rel=1e-9)
    np.testing.assert_allclose(response.value, expected().value, rtol=1e-9)
    np.testing.assert_allclose(response.sigma, expected().sigma, rtol=1e-6)
    assert response.estimator == "joint"
    assert response.unit == ("rad/s/(N m)" if "pandas" in way or "xarray" in way else "")


def test_polars_gives_columns_that_numpy_reads() -> None:
    """A column of Polars is what has `name` and converts itself; a missing value is NaN."""

    class Column:
        name = "velocity [rad/s]"

        def __array__(self, dtype: object = None, copy: bool | None = None) -> np.ndarray:
            return signals()[2]

    np.testing.assert_array_equal(livebode.frf(*signals()[:2], Column(), fs=RATE_HZ).value, expected().value)


def test_whole_numbers_are_samples() -> None:
    counts = [np.round(x * 1e6).astype(np.int32) for x in signals()]
    np.testing.assert_allclose(livebode.frf(*counts, fs=RATE_HZ).value, expected().value, rtol=1e-3)


def test_the_rows_of_track_are_those_of_a_run_on_the_same_samples(tmp_path: Path) -> None:
    run = livebode.example_run(tmp_path / "run")
    rows = livebode.track(*signals(), fs=RATE_HZ, hop=100)
    assert rows.sample.tolist() == run.responses.sample.tolist()
    np.testing.assert_allclose(rows.value, run.responses.value, rtol=1e-6)
    np.testing.assert_allclose(rows.mean().value, run.average.value, rtol=1e-6)
    np.testing.assert_allclose(rows.mean().sigma, run.average.sigma, rtol=1e-5)


def test_several_outputs_are_a_list_of_responses_and_each_is_that_of_its_own_call() -> None:
    w, u, y = signals()
    first, second = livebode.frf(w, u, [y, 3 * y], fs=RATE_HZ)
    np.testing.assert_array_equal(first.value, expected().value)
    np.testing.assert_allclose(second.value, 3 * first.value, rtol=1e-9)


def test_one_response_averages_all_periods_and_track_gives_each() -> None:
    rows = livebode.track(*signals(), fs=RATE_HZ)
    assert rows[-1].sigma.mean() > 2 * expected().sigma.mean()
    assert expected().sample - expected().first + 1 == 4000


def test_two_signals_are_direct_where_they_repeat_and_by_local_polynomials_where_they_do_not() -> None:
    u = np.random.default_rng(1).standard_normal(20_000)
    y = np.convolve(u, [0.1, 0.3, 0.2])[: u.size]
    direct, polynomial = livebode.frf(*signals()[1:], fs=RATE_HZ), livebode.frf(u, y, fs=1000)
    assert "direct estimate" in repr(direct)
    assert "lpm estimate" in repr(polynomial)
    truth = np.polyval([0.2, 0.3, 0.1], np.exp(-2j * np.pi * polynomial.frequency_hz / 1000))
    np.testing.assert_allclose(polynomial.value, truth, rtol=1e-3)


def test_welch_uses_the_whole_of_the_signals() -> None:
    u = np.random.default_rng(1).standard_normal(20_000)
    y = np.convolve(u, [0.1, 0.3, 0.2])[: u.size]
    response, whole = (
        livebode.frf(u, y, fs=1000, estimator="welch", window=500),
        livebode.welch(u, y, fs=1000, window=500),
    )
    np.testing.assert_allclose(response.value, whole(response.frequency_hz), rtol=1e-12)
    assert (response.estimator, response.sample) == ("welch", 19_999)


def test_missing_samples_cost_their_windows_and_are_a_warning_at_the_call() -> None:
    longer = livebode.example_axis(2.0).run()[0]
    w, u, y = (longer[name].copy() for name in NAMES)
    y[3000:3010] = np.nan
    with pytest.warns(SignalWarning, match="not finite") as caught:
        response = livebode.frf(w, u, y, fs=RATE_HZ)
    assert caught[0].filename == __file__
    assert response.valid.all()
    assert np.all(np.abs(response.value - expected().value) < 2 * (response.bound(2) + expected().bound(2)))


def test_a_gap_of_the_index_is_a_gap_of_the_signals() -> None:
    table = frame()
    table = table.drop(table.index[2000:2050])
    with pytest.warns(SignalWarning, match="50 samples are missing before sample 2050"):
        livebode.frf(*(table[name] for name in NAMES.values()))


def test_signals_too_short_for_a_bound_have_a_warning() -> None:
    given = {"lines": "20:140:10", "window": 400, "estimator": "joint"}
    with pytest.warns(SignalWarning, match="no bound is known"):
        response = livebode.frf(*(x[:700] for x in signals()), fs=RATE_HZ, **given)
    assert np.isnan(response.bound()).all()


def test_open_gives_a_run_or_the_channels_of_a_recording(tmp_path: Path) -> None:
    run = livebode.example_run(tmp_path / "run")
    assert isinstance(livebode.open(run.path), livebode.Run)
    with refused(UsageError, "conflict", argument="fs"):
        livebode.open(run.path, fs=RATE_HZ)
    times = np.delete(np.arange(8) / RATE_HZ, [3, 4])
    write_parquet(tmp_path / "log.parquet", Table.of({"t [s]": times, "u [N m]": np.delete(np.arange(8.0), [3, 4])}))
    log = livebode.open(tmp_path / "log.parquet")
    assert isinstance(log, livebode.Log)
    np.testing.assert_array_equal(log["u"], [0, 1, 2, np.nan, np.nan, 5, 6, 7])


def test_the_names_that_users_of_python_control_guess_have_its_units() -> None:
    frd = expected().to_frd()
    np.testing.assert_allclose(expected().omega, frd.omega)
    np.testing.assert_allclose(expected().magnitude, np.abs(frd.frdata[0, 0]))
    np.testing.assert_allclose(expected().phase, np.angle(frd.frdata[0, 0]))


def test_a_plot_takes_axes_by_either_name() -> None:
    from matplotlib.figure import Figure

    axes = Figure().subplots(2)
    assert list(expected().plot(ax=axes)) == list(axes)
    assert list(expected().bode(axes=axes)) == list(axes)


def test_a_response_that_no_line_has_is_refused_in_words_of_the_call() -> None:
    w, u, y = signals()
    with pytest.raises(SignalError, match=r"look exchanged.*pass accept_roles=True"):
        livebode.frf(w, y, u, fs=RATE_HZ)
    with pytest.warns(SignalWarning, match="look exchanged"):
        livebode.frf(w, y, u, fs=RATE_HZ, accept_roles=True)
