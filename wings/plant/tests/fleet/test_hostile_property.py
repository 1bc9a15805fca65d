"""Whatever an edge sends: the stream of its axis raises nothing, and its results and its state can be stored."""

from __future__ import annotations

import zlib

from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.sources.live import encode_layout
from livebode.sources.live.frame import layout_text
from livebode.sources.live.framing import SAMPLES, framed
from livebode_plant.fleet.alike_axes import Output
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.message import write_message
from livebode_plant.fleet.result_message import PendingResults, ResultMessage
from livebode_plant.fleet.server_config import PAYLOAD_BYTES_MAX
from tests.support.fleet_runs import CHANNELS, batch, fleet_axes
from tests.support.fleet_runs import SAMPLES as COUNT

((KEY, AXIS),) = fleet_axes(1).items()
GOOD = [write_message(batch(0, first)) for first in range(0, 12 * COUNT, COUNT)]
UNSIGNED = st.one_of(st.sampled_from([0, 1, 2**53, 2**63 - 1, 2**63, 2**64 - 1]), st.integers(0, 2**64 - 1))
RATES = st.one_of(st.sampled_from([0.0, -1.0, 1000.0, 1e300, 5e-324]), st.floats())


@st.composite
def forged(draw: st.DrawFn) -> bytes:
    """A message whose checksums are right and whose fields are anything."""
    epoch, sample, stamp, rate = draw(UNSIGNED), draw(UNSIGNED), draw(UNSIGNED), draw(RATES)
    count = draw(st.integers(0, 60))
    payload = draw(st.binary(max_size=16)) or bytes(count * len(CHANNELS) * 4)
    layout = zlib.crc32(layout_text(CHANNELS))
    return encode_layout(CHANNELS, rate, epoch=epoch) + framed(
        SAMPLES, 0, 0, epoch, sample, stamp % 2**63, rate, layout, len(CHANNELS), count, payload
    )


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """A good message with some bytes changed, removed or repeated."""
    message = bytearray(draw(st.sampled_from(GOOD)))
    for at in draw(st.lists(st.integers(0, len(message) - 1), min_size=1, max_size=4)):
        message[at] ^= draw(st.integers(1, 255))
    return bytes(message[: draw(st.integers(0, len(message)))]) + draw(st.sampled_from([b"", b"LBOD", bytes(message)]))


HOSTILE = st.one_of(st.binary(max_size=200), forged(), damaged())


@given(st.lists(st.one_of(HOSTILE, st.sampled_from(GOOD)), max_size=12))
@settings(max_examples=60, deadline=None)
def test_any_messages_give_results_and_a_state_that_can_be_stored(messages: list[bytes]) -> None:
    stream, again, pending = AxisStream(AXIS, 1), AxisStream(AXIS, 1), PendingResults()
    for number, message in enumerate(messages, 1):
        output = stream.process(message, number, 1e9 + number)
        assert _bits(output) == _bits(again.process(message, number, 1e9 + number))
        pending.add(KEY, stream, output)
    stored = pending.message(len(messages), "a:1").to_bytes()
    assert ResultMessage.from_bytes(stored).through == len(messages)
    assert len(stored) < PAYLOAD_BYTES_MAX
    state = stream.snapshot()
    restored = AxisStream(AXIS, 0)
    restored.restore(state)
    assert restored.snapshot() == state


@given(st.binary(max_size=200))
@settings(max_examples=40, deadline=None)
def test_random_bytes_among_good_messages_change_no_response(noise: bytes) -> None:
    clean, disturbed = AxisStream(AXIS, 1), AxisStream(AXIS, 1)
    expected, found = b"", b""
    for number, message in enumerate(GOOD[:6], 1):
        expected += _bits(clean.process(message, 2 * number, 1e9 + number))
        found += _bits(disturbed.process(noise, 2 * number - 1, 1e9 + number))
        found += _bits(disturbed.process(message, 2 * number, 1e9 + number))
    assert len(expected) > 0
    assert found[: len(expected)] == expected[: len(found)]
    assert abs(len(found) - len(expected)) <= len(expected) // 2


def test_a_message_with_more_responses_than_can_be_stored_is_dropped_with_an_event() -> None:
    lines = AXIS.tracking.model_copy(update={"hop": 1})
    stream = AxisStream(AXIS.model_copy(update={"tracking": lines}), 1)
    channels = len(CHANNELS)
    count = 60_000
    layout = zlib.crc32(layout_text(CHANNELS))
    found = []
    for number, first in enumerate(range(0, 4 * count, count), 1):
        long = encode_layout(CHANNELS, 1000.0, epoch=1) + framed(
            SAMPLES, 0, 0, 1, first, 0, 1000.0, layout, channels, count, bytes(count * channels * 4)
        )
        found.append(stream.process(long, number, 1e9 + number))
    assert [output.responses for output in found] == [None] * 4
    assert stream.responses == 0
    assert any("too many samples" in event.message for output in found for event in output.events), found


def _bits(output: Output) -> bytes:
    if output.responses is None:
        return b""
    return b"".join(one.tobytes() + two.tobytes() for one, two in zip(output.responses.value, output.responses.sigma))
