"""From a drive's spectra the responses are those that a Tracker gives from the same samples."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import (
    PID,
    Block,
    Cascade,
    Channel,
    Event,
    Lines,
    LivebodeError,
    Loop,
    Responses,
    SignalError,
    Spectra,
    SpectraLayout,
    UsageError,
)
from livebode.estimation import RippleOrder, Settings, SpectraTracker, Tracker
from livebode.excitation import multisine
from livebode.simulation import TwoMassLoop
from livebode.simulation.two_mass_loop import KPC, KVC, RATE_HZ, TI
from livebode.sources.live import FrameDecoder, encode_spectra, encode_spectra_layout
from livebode.sources.live.kernel_drive import KernelDrive
from tests.support.errors import refused

WINDOW, PERIODS = 400, 12
LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=WINDOW)
SIGNALS = (Channel("y", "rad/s"), Channel("u", "N m"), Channel("w", "N m"))
LOOP = Loop(
    Cascade(PID(gain=KVC, integral_time_s=TI, rate_hz=RATE_HZ), PID(gain=KPC, rate_hz=RATE_HZ / 2, rate_divider=2))
)


def layout(hop: int = 20, **options: object) -> SpectraLayout:
    given = {"quiet": (1, *LINES.quiet, 15, 16, 17, 18)} | options
    return SpectraLayout(SIGNALS, (Channel("x", "m"),), WINDOW, hop, LINES.bins, **given)


@pytest.fixture(scope="module")
def record() -> Block:
    """The loop of the examples under noise, and a position that moves."""
    rng = np.random.default_rng(3)
    w = multisine(LINES)
    u, y = TwoMassLoop().run(w, periods=PERIODS)
    n = w.size * PERIODS
    noise = rng.standard_normal((2, n)) * 1e-3
    return Block(
        np.array(
            [y[0] + noise[0] * np.std(y[0]), u[0] + noise[1] * np.std(u[0]), np.tile(w, PERIODS), np.arange(n) * 1e-4]
        ),
        (*SIGNALS, Channel("x", "m")),
        RATE_HZ,
    )


def sent(block: Block, what: SpectraLayout, dtype: str = "float32", samples: int = 170) -> Iterator[Spectra]:
    """What arrives of a drive's spectra, through frames."""
    decoder = FrameDecoder()
    decoder.decode(encode_spectra_layout(what, block.rate_hz))
    pieces = (block.cut(at, at + samples) for at in range(0, len(block), samples))
    for batch in KernelDrive(what, dtype).spectra(pieces):
        got = decoder.decode(encode_spectra(batch, double=dtype == "float64"))
        yield got.block(got.first_sample, got.first_sample, gap=False)


def tracked(spectra: Iterator[Spectra], what: SpectraLayout, **options: object) -> Responses:
    tracker = SpectraTracker(described(what.hop, **options), what)
    return Responses.join([tracker.process(block) for block in spectra])


def described(hop: int, **options: object) -> Settings:
    given = {"lines": LINES, "output": "y", "input": "u", "excitation": "w", "schedule": "x", "hop": hop} | options
    return Settings(**given)


def same(ours: Responses, theirs: Responses) -> None:
    for name in ("value", "sigma", "dof", "coherence", "valid", "first", "sample", "time_s"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), err_msg=name)
    assert (ours.lines, ours.unit, ours.quantity) == (theirs.lines, theirs.unit, theirs.quantity)


@pytest.mark.parametrize("hop", [20, 50, 400, 800])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"estimator": "direct"},
        {"estimator": "indirect", "loop": LOOP},
        {"average": True, "forgetting": 0.9},
        {"hann": True},
        {"noise": "quiet"},
        {"quantity": "sensitivity", "loop": Loop(input_logged="before", output_logged="after")},
    ],
)
def test_float32_spectra_give_what_float32_samples_give_to_the_bit(record: Block, hop: int, options: dict) -> None:
    ours = tracked(sent(record, layout(hop)), layout(hop), **options)
    theirs = Tracker(described(hop, dtype="float32", **options)).process(record)
    same(ours, theirs)
    np.testing.assert_allclose(ours.schedule, theirs.schedule, rtol=2.0**-23)  # of a mean, a digit more
    assert ours.valid[-1].all()


@pytest.mark.parametrize("hop", [20, 800])
def test_float64_frames_lose_nothing(record: Block, hop: int) -> None:
    ours = tracked(sent(record, layout(hop), "float64"), layout(hop))
    theirs = Tracker(described(hop)).process(record)
    same(ours, theirs)
    np.testing.assert_array_equal(ours.schedule, theirs.schedule)


def test_a_ripple_is_in_the_bound_of_spectra_as_in_that_of_samples(record: Block) -> None:
    """The position goes 0.4 a second, where 150 cycles are 60 Hz."""
    ripple = (RippleOrder(150.0, 0.05),)
    ours = tracked(sent(record, layout(), "float64"), layout(), ripple=ripple)
    theirs = Tracker(described(20, ripple=ripple)).process(record)
    without = Tracker(described(20)).process(record)
    np.testing.assert_allclose(ours.sigma[1:], theirs.sigma[1:], rtol=1e-6)
    wider = np.nanmedian(theirs.sigma / without.sigma, axis=0)
    assert wider[2] > 5
    assert wider[[0, 1, 3, 4]] == pytest.approx(np.ones(4), abs=0.1)


def test_float32_is_off_by_no_more_than_its_kernel_promises(record: Block) -> None:
    ours = tracked(sent(record, layout()), layout(), estimator="direct")
    exact = Tracker(described(20, estimator="direct")).process(record)
    # 1e-6·√N·‖x‖₂ of the window for each spectrum, and half a unit of the last digit of each sample besides.
    share = 0.0
    for name in ("y", "u"):
        x = record[name][-WINDOW:]
        promised = (1e-6 + 2.0**-24) * np.sqrt(WINDOW) * np.linalg.norm(x)
        share = share + promised / np.abs(np.fft.fft(x)[list(LINES.bins)])
    assert np.all(np.abs(ours.value[-1] / exact.value[-1] - 1) < share)


def test_a_constant_that_is_subtracted_saves_the_digits(record: Block) -> None:
    offset = np.array([[1e4], [0.0], [0.0], [0.0]])
    far = Block(record.data + offset, record.channels, RATE_HZ)
    near = layout(subtracted=(1e4, 0.0, 0.0))
    exact = Tracker(described(20)).process(record).value[-1]
    plain, less = (np.abs(tracked(sent(far, what), what).value[-1] / exact - 1).max() for what in (layout(), near))
    assert 100 * less < plain


def test_a_drive_that_differences_is_exact_for_a_signal_that_drifts(record: Block) -> None:
    ramp = np.zeros_like(record.data)
    ramp[0] = np.arange(len(record)) * 1e-2
    drifting = Block(record.data + ramp, record.channels, RATE_HZ)
    what = layout(differenced=(True, False, False))
    theirs = Tracker(described(20, differenced=("y",))).process(drifting)
    same(tracked(sent(drifting, what, "float64"), what), theirs)
    same(tracked(sent(drifting, what, "float64"), what, differenced=("y",)), theirs)


def test_samples_that_are_not_finite_leave_the_same_windows_out(record: Block) -> None:
    data = record.data.copy()
    data[0, 1234], data[1, 2500] = np.nan, np.inf
    broken = Block(data, record.channels, RATE_HZ)
    what = layout()
    tracker = SpectraTracker(described(20), what)
    found: list[Event] = []
    ours = Responses.join([tracker.process(block, found.append) for block in sent(broken, what)])
    same(ours, Tracker(described(20, dtype="float32")).process(broken))
    kinds = ["noise-from-detection-lines", "not-whole", "not-whole"]  # the position moves
    assert [event.kind for event in found] == kinds
    assert tracker.counts["samples"] == len(record)


def test_marks_of_the_drive_and_numbers_that_are_none_are_left_out(record: Block) -> None:
    what = layout(hop=WINDOW)
    blocks = list(sent(record, what, samples=WINDOW))
    blocks[5].state[:] = 2
    blocks[7].sums[1, 0, 3] = np.nan
    blocks[9].sums[0, 0, 2] *= 1e12
    tracker = SpectraTracker(described(WINDOW), what)
    found: list[Event] = []
    ours = Responses.join([tracker.process(block, found.append) for block in blocks])
    assert np.flatnonzero(~ours.valid.any(axis=1)).tolist() == [5, 7, 9]
    kinds = [("spike", 2399), ("not-whole", 3199), ("implausible", 3999)]
    events = [(e.kind, e.sample) for e in found]
    assert [e for e in events if e[0] != "noise-from-detection-lines"] == kinds
    assert len(events) == len(kinds) + 1  # the position moves: known from the eighth spectrum on
    assert {kind: tracker.counts[kind] for kind, _ in kinds} == {kind: 1 for kind, _ in kinds}
    assert tracker.counts["spectra"] == PERIODS
    # An average goes on over a spike, as it does from samples.
    assert tracked(iter(blocks), what, average=True).valid[5].all()


def test_lost_spectra_leave_the_others_as_they_are(record: Block) -> None:
    what = layout()
    blocks = list(sent(record, what, samples=100))
    kept = [block for at, block in enumerate(blocks) if at % 7 != 3]
    tracker = SpectraTracker(described(20), what)
    ours = Responses.join([tracker.process(block) for block in kept])
    theirs = Tracker(described(20, dtype="float32")).process(record)
    at = np.searchsorted(theirs.sample, ours.sample)
    np.testing.assert_array_equal(ours.value, theirs.value[at])
    np.testing.assert_array_equal(ours.valid, theirs.valid[at])
    assert tracker.counts["gaps"] == len(blocks) - len(kept)
    assert tracker.counts["missing"] == 100 * (len(blocks) - len(kept))
    with refused(SignalError, "repeated"):
        tracker.process(kept[-1])


@settings(max_examples=20, deadline=None)
@given(cuts=st.lists(st.integers(0, 120), max_size=6), stop=st.integers(0, 119))
def test_any_cutting_and_a_restored_tracker_give_the_same(record: Block, cuts: list[int], stop: int) -> None:
    what, hop = layout(hop=40), 40
    whole = next(sent(record, what, samples=len(record)))
    one = SpectraTracker(described(hop), what)
    expected = one.process(whole)
    edges = sorted({0, len(whole), *cuts, stop})
    tracker, parts = SpectraTracker(described(hop), what), []
    for a, b in pairwise(edges):
        if a == stop:
            other = SpectraTracker(described(hop), what)
            other.restore(tracker.snapshot())
            tracker = other
        parts.append(tracker.process(whole.cut(a, b)))
    same(Responses.join(parts), expected)
    assert tracker.counts == one.counts


def test_a_drive_with_an_unknown_instruction_set_is_refused_as_a_tracker_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIVEBODE_INSTRUCTION_SET", "mmx")
    with refused(UsageError, "not-one-of", argument="LIVEBODE_INSTRUCTION_SET", value="mmx"):
        KernelDrive(layout())


@pytest.mark.parametrize(
    ("options", "what", "code"),
    [
        ({"hop": 40}, {}, "signal.layout-differs"),
        ({"lines": Lines.parse("20", RATE_HZ, WINDOW)}, {}, "signal.layout-differs"),
        ({"spikes": ("u",)}, {}, "usage.conflict"),
        ({"dtype": "float32"}, {}, "usage.conflict"),
        ({"output": "x"}, {}, "signal.channel-unknown"),
        ({"schedule": "y"}, {}, "signal.channel-unknown"),
        ({"differenced": ("y",)}, {}, "signal.layout-differs"),
    ],
)
def test_settings_that_need_samples_are_refused_for_spectra(options: dict, what: dict, code: str) -> None:
    with pytest.raises(LivebodeError) as caught:
        SpectraTracker(described(**({"hop": 20} | options)), layout(**what))
    assert caught.value.code == code
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "what", "message"),
    [
        ({"hann": True}, {"quiet": LINES.quiet}, "a Hann window needs bin 1, which the drive does not send"),
        ({"noise": "quiet"}, {"quiet": (3, 5)}, "the noise needs bin 7, which the drive does not send"),
    ],
)
def test_bins_that_the_drive_does_not_send_are_named(options: dict, what: dict, message: str) -> None:
    with pytest.raises(LivebodeError, match=message) as caught:
        SpectraTracker(described(**({"hop": 20} | options)), layout(**what))
    assert "\n" not in str(caught.value)


def test_samples_and_other_layouts_are_refused(record: Block) -> None:
    tracker = SpectraTracker(described(20), layout())
    for wrong in (record, next(sent(record, layout(quiet=())))):
        with refused(SignalError, "layout-differs"):
            tracker.process(wrong)
