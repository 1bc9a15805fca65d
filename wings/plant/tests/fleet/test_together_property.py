"""Messages that are tracked together give the bits of messages that are tracked one by one, whatever they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.configuration import Axis
from livebode.core import PER_LINE, PER_RESPONSE, Responses, SpectraLayout
from livebode.sources.live import SpectraBatch
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.message import write_message
from tests.support.fleet_runs import CHANNELS, EPOCH, RATE_HZ, SAMPLES, WINDOW, batch, fleet_axes

((_, AXIS),) = fleet_axes(1).items()
COUNT, RESTARTED = 24, 9 * EPOCH
HOP = 25


def _spectrum(number: int, epoch: int = EPOCH) -> bytes:
    layout = SpectraLayout(CHANNELS, (), window=WINDOW, hop=HOP, lines=(2, 4, 6, 8, 10))
    rng = np.random.default_rng([number, epoch])
    sums = (rng.standard_normal((3, 1, 5, 2)) * 0.01 + [1.0, 0.5]) @ [1, 1j]
    state = np.array([number % 7 == 3], np.uint32)
    return write_message(SpectraBatch(number * HOP, sums, np.zeros((0, 1)), state, layout, RATE_HZ, epoch=epoch))


SAMPLE_MESSAGES = [write_message(batch(0, n * SAMPLES)) for n in range(COUNT)]
RESTART = [write_message(batch(0, n * SAMPLES, RESTARTED)) for n in range(4)]
STREAMS = {
    "samples": [*SAMPLE_MESSAGES, *RESTART, b"damaged"],
    "spectra": [*map(_spectrum, range(COUNT)), *(_spectrum(n, RESTARTED) for n in range(4)), b"damaged"],
}
DAMAGED = COUNT + len(RESTART)


@st.composite
def disturbed(draw: st.DrawFn) -> list[int]:
    """Numbers of messages: some lost, repeated, damaged or swapped, and perhaps a restart of the sender."""
    found = [number for number in range(COUNT) if draw(st.integers(0, 15))]
    for at in draw(st.lists(st.integers(0, max(0, len(found) - 2)), max_size=3)):
        one, two = [*found, 0, 0][at : at + 2]
        found[at : at + 2] = draw(st.sampled_from([[two, one], [one, one, two], [one, DAMAGED]]))
    return found + draw(st.sampled_from([[], list(range(COUNT, DAMAGED))]))


def _tracked(axis: Axis, messages: list[bytes], cuts: set[int], restored: set[int]) -> tuple[Any, ...]:
    """Responses, events and state; outputs are taken at the cuts, and at some the stream continues from a state."""
    stream, parts, events = AxisStream(axis, 1), [], []
    for number, message in enumerate(messages, 1):
        stream.add(message, number, 1e9 + 0.05 * number)
        if number in cuts or number == len(messages):
            output = stream.output()
            parts += [] if output.responses is None else [output.responses]
            events += output.events
            assert stream.responses == sum(map(len, parts))
        if number in cuts & restored:
            state = stream.snapshot()
            stream = AxisStream(axis, 0)
            stream.restore(state)
    whole = Responses.join(parts) if parts else None
    rows = {} if whole is None else {name: getattr(whole, name).tobytes() for name in PER_LINE + PER_RESPONSE}
    return rows, stream.snapshot(), sorted(map(repr, events))


NUMBERS = st.sets(st.integers(1, COUNT))


@given(st.sampled_from(list(STREAMS)), disturbed(), NUMBERS, NUMBERS)
@settings(max_examples=25, deadline=None)
def test_the_cut_of_the_messages_changes_no_bit_of_responses_events_and_state(
    kind: str, numbers: list[int], cuts: set[int], restored: set[int]
) -> None:
    messages = [STREAMS[kind][number] for number in numbers]
    one_by_one = _tracked(AXIS, messages, set(range(1, len(messages) + 1)), set())
    assert _tracked(AXIS, messages, cuts, set()) == one_by_one
    assert _tracked(AXIS, messages, cuts, restored)[0] == one_by_one[0]


@pytest.mark.parametrize("kind", list(STREAMS))
def test_the_messages_are_tracked(kind: str) -> None:
    rows, _, events = _tracked(AXIS, STREAMS[kind][:COUNT], set(), set())
    assert len(rows["sample"]) == 8 * COUNT * (SAMPLES // HOP if kind == "samples" else 1)
    assert not any("failed" in event for event in events)


def test_an_axis_that_cannot_be_tracked_fails_with_the_same_event_however_its_messages_are_taken() -> None:
    wrong = AXIS.model_copy(update={"signals": AXIS.signals.model_copy(update={"outputs": "z"})})
    one_by_one = _tracked(wrong, SAMPLE_MESSAGES, set(range(1, COUNT + 1)), set())
    assert _tracked(wrong, SAMPLE_MESSAGES, set(), set()) == one_by_one
    assert len(one_by_one[2]) == 1


def test_messages_that_are_too_long_are_dropped_alone_among_others_taken_with_them() -> None:
    axis = AXIS.model_copy(update={"tracking": AXIS.tracking.model_copy(update={"hop": 1})})
    long = write_message(_long(12 * SAMPLES, 20_000))
    after = write_message(_long(12 * SAMPLES + 20_000, 100))
    messages = [*SAMPLE_MESSAGES[:12], long, after]
    one_by_one = _tracked(axis, messages, set(range(1, len(messages) + 1)), set())
    assert _tracked(axis, messages, set(), set()) == one_by_one
    assert any("too many samples" in event for event in one_by_one[2])
    assert len(one_by_one[0]["sample"]) == 8 * (12 * SAMPLES + 100)


def _long(first: int, count: int) -> Any:
    parts = [batch(0, first + at) for at in range(0, count, SAMPLES)]
    one = parts[0]
    data = np.concatenate([part.data for part in parts], axis=1)
    return type(one)(first, data, one.channels, one.rate_hz, one.epoch)
