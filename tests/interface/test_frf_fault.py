"""Errors that users of SciPy make: each has one sentence with the value and a remedy, and the remedy works."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import livebode
from livebode.core import LivebodeError, SignalError, with_bound
from livebode.interface import write_examples

N = 4000


@cache
def signals() -> tuple[np.ndarray, ...]:
    block, _ = livebode.example_axis().run()
    return block["w"], block["u"], block["velocity"]


def frf(y: object = None, *, fs: object = 4000, **options: object) -> livebode.Response:
    w, u, usual = signals()
    return livebode.frf(w, u, usual if y is None else y, fs=fs, **options)


def jittering():
    import pandas

    late_us = np.random.default_rng(1).integers(-90, 90, N)
    index = pandas.date_range("2026-01-01", periods=N, freq="250us") + pandas.to_timedelta(late_us, unit="us")
    return [pandas.Series(x, index=index) for x in signals()]


def shifted():
    import pandas

    index = pandas.date_range("2026-01-01", periods=N, freq="250us")
    return [pandas.Series(x, index=index + pandas.Timedelta(seconds=k)) for k, x in enumerate(signals())]


CALLS: dict[str, tuple[Callable[[], object], str, str]] = {
    "no rate": (
        lambda: livebode.frf(*signals()),
        "usage.missing",
        "fs is missing; give the samples per second, as fs=",
    ),
    "a rate that is text": (lambda: frf(fs="4000"), "usage.unreadable", "fs='4000' is not a number"),
    "a rate of zero": (lambda: frf(fs=0), "usage.out-of-range", "fs=0.0 is not a positive finite number"),
    "a rate as fourth signal": (lambda: livebode.frf(*signals(), 4000), "usage.wrong-shape", "frf got 4 signals"),
    "a rate as third signal": (
        lambda: livebode.frf(*signals()[1:], 4000),
        "usage.wrong-shape",
        "give it by its name: fs=4000",
    ),
    "a matrix": (lambda: livebode.frf(np.array(signals()), fs=4000), "usage.wrong-shape", "frf got 1 signal without"),
    "two columns": (
        lambda: frf(np.column_stack(signals()[1:])),
        "usage.wrong-shape",
        "y has shape (4000, 2), which",
    ),
    "two rows": (lambda: frf(np.array(signals()[1:])), "usage.wrong-shape", "y has shape (2, 4000)"),
    "another length": (
        lambda: frf(signals()[2][:-1]),
        "usage.wrong-shape",
        "w has 4000, u has 4000 and y has 3999 samples",
    ),
    "a spectrum": (lambda: frf(np.fft.fft(signals()[2])), "usage.unreadable", "y is complex"),
    "text": (lambda: frf(["1,5"] * N), "usage.unreadable", "y has values of type <U3, not real numbers"),
    "objects": (lambda: frf(np.array([{}] * N)), "usage.unreadable", "y cannot be read as numbers: float() argument"),
    "dates": (lambda: frf(np.zeros(N, "M8[us]")), "usage.unreadable", "datetime64[us], not real numbers"),
    "nothing": (lambda: frf([]), "usage.wrong-shape", "y is empty"),
    "None": (lambda: livebode.frf(*signals()[:2], None, fs=4000), "usage.missing", "y is None"),
    "NaN alone": (lambda: frf(np.full(N, np.nan)), "signal.channel-empty", "none of its samples is a finite number"),
    "a constant": (lambda: frf(np.zeros(N)), "signal.channel-constant", "'y' is constant at 0"),
    "three samples": (
        lambda: livebode.frf(*(x[:3] for x in signals()), fs=4000),
        "signal.too-short",
        "3 samples are too few",
    ),
    "a taper as window": (lambda: frf(window="hann"), "usage.unreadable", "window='hann' is not a number of samples"),
    "a window that is no period": (
        lambda: frf(window=1024),
        "signal.no-line-above-noise",
        'window="auto" finds the period',
    ),
    "a line between two": (lambda: frf(lines=[35.5], window=400), "grid.line-off", "35.5 Hz is not on the 10 Hz grid"),
    "a line without power": (lambda: frf(lines=[150]), "signal.line-not-excited", "set lines to 'auto'"),
    "an unknown estimator": (lambda: frf(estimator="H1"), "usage.not-one-of", "auto, joint, direct, lpm, welch"),
    "joint without w": (
        lambda: livebode.frf(*signals()[1:], fs=4000, estimator="joint"),
        "usage.conflict",
        "call frf(w, u, y, …)",
    ),
    "several outputs of track": (
        lambda: livebode.track(*signals()[:2], [signals()[2]] * 2, fs=4000),
        "usage.too-many",
        "call it for each output",
    ),
    "an index that jitters": (
        lambda: livebode.frf(*jittering()),
        "recording.time-irregular",
        "values alone, as u.to_numpy()",
    ),
    "an index and another rate": (
        lambda: livebode.frf(*(x.drop(x.index[4:]) for x in shifted()[:1]), *(x[:4] for x in signals()[1:]), fs=99),
        "recording.rate-conflict",
        "correct fs, or give the",
    ),
    "indices that differ": (lambda: livebode.frf(*shifted()), "usage.conflict", "w and u have different times"),
    "one signal of welch": (
        lambda: livebode.welch(signals()[0], fs=4000),
        "usage.wrong-shape",
        "welch(w, u, y, fs=4000)",
    ),
    "no file": (lambda: livebode.open("nothing.csv", fs=4000), "recording.not-found", "no file nothing.csv"),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_call_that_cannot_be_answered_says_so_in_one_sentence(name: str) -> None:
    call, code, words = CALLS[name]
    with pytest.raises(LivebodeError) as caught:
        call()
    text = str(caught.value)
    assert (caught.value.code, words in text) == (code, True), f"{caught.value.code}: {text}"
    assert "\n" not in text
    assert ";" in text  # a remedy
    assert not any(word in text for word in ("lines.", "tracking.", "signals.", "livebode inspect", "--", "rate_hz"))


def test_the_remedies_work() -> None:
    w, u, y = signals()
    assert frf(window="auto").valid.all()
    assert frf(lines="auto").valid.all()
    assert livebode.frf(*(x.to_numpy() for x in jittering()), fs=4000).valid.all()
    assert livebode.frf(u, y, fs=4000, estimator="direct").valid.all()
    first, _ = livebode.frf(w, u, list(np.array([y, y])), fs=4000)
    assert first.valid.all()


def test_an_unknown_keyword_is_an_error() -> None:
    with pytest.raises(TypeError, match="rate"):
        livebode.frf(*signals(), rate=4000)


def test_of_noise_that_the_input_does_not_follow_the_sentence_names_the_input() -> None:
    lines = livebode.Lines.parse("4:199:3", 4000, 4000)
    u = np.tile(livebode.multisine(lines, 1.0), 20)
    with pytest.raises(SignalError, match="or 'u' does not follow it; check the roles"):
        livebode.frf(np.random.default_rng(0).standard_normal(len(u)), u, np.roll(u, 3), fs=4000)


def test_what_a_fit_and_a_recording_show_are_numbers_to_their_bounds_and_what_is_in_it(tmp_path: Path) -> None:
    write_examples(["standstill"], tmp_path)
    log = livebode.open(tmp_path / "standstill.csv")
    assert "csv, 8000 samples at 4000 Hz" in repr(log)
    fit = livebode.fit(livebode.frf(log["w"], log["u"], log["velocity"], fs=log.rate_hz), "two-mass")
    row = next((value, bound) for name, value, bound, _ in fit.rows() if name == "resonance")
    assert f"resonance = {' ± '.join(with_bound(*row))} Hz" in repr(fit)
