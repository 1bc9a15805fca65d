"""Spectra of many axes in one computation: the bits of an axis are those of it alone, whatever the others send."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from livebode.configuration import Axis
from livebode.core import PER_LINE, PER_RESPONSE, Channel, Responses, SpectraLayout
from livebode.sources.live import SpectraBatch
from livebode_plant.fleet.alike_axes import Output, outputs_together, stacked_together
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.message import message_id, write_message
from livebode_plant.fleet.result_message import PendingResults
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.subjects import EDGE
from tests.support.fleet_runs import (
    CHANNELS,
    EPOCH,
    PARTITIONS,
    RATE_HZ,
    WINDOW,
    checked,
    fleet_axes,
    log_section,
    owned_until_current,
)

LINES = (2, 4, 6, 8, 10)
COUNT, RESTARTED = 24, 9 * EPOCH
POSITION = (Channel("x", "m"),)
_SIGNALS = {"output": "y", "input": "u", "excitation": "w"}
_SOURCE = {"url": "udp://127.0.0.1:5000"}
_TRACKED: list[dict[str, Any]] = [
    {},
    {},
    {"tracking": {"average": True, "forgetting": 0.5}},
    {"tracking": {"average": True, "forgetting": 0.5}, "source": _SOURCE | {"kinds": {"y": "other"}}},
    {"signals": _SIGNALS | {"schedule": "x"}},
    {"signals": _SIGNALS | {"schedule": "x"}},
    {"fit": {"model": "rigid"}},
    {"source": _SOURCE | {"units": {"u": "0.5 N m"}}},
]
"""Axes 0 and 1, and 4 and 5, are alike; 2 and 3 but for a kind; 6 is fitted, and 7 has the unit of its drive."""
AXES = len(_TRACKED)


def _axis(number: int) -> Axis:
    ((_, axis),) = fleet_axes(1).items()
    lines = {"frequencies": "20:100:20", "window": WINDOW}
    about = {"source": _SOURCE, "signals": _SIGNALS, "lines": lines}
    return Axis.of(about | {"machine": axis.machine.model_dump(exclude_none=True)} | _TRACKED[number], "a test")


def _message(axis: int, number: int, kind: str = "whole") -> bytes:
    hop = (25, 25, 100, 100, 200, 200, 100, 25)[axis]
    layout = SpectraLayout(CHANNELS, POSITION if axis in (4, 5) else (), window=WINDOW, hop=hop, lines=LINES)
    rng = np.random.default_rng([axis, number])
    frequency = np.asarray(LINES) * RATE_HZ / WINDOW
    truth = np.stack([np.ones(5), np.full(5, 0.7 + 0.1j), 0.7 / (2j * np.pi * frequency)])[:, np.newaxis]
    sums = 50 * truth * (1 + 0.01 * (rng.standard_normal((3, 1, 5, 2)) @ [1, 1j]))
    if kind == "not finite":
        sums[1, 0, 2] = np.inf
    if kind == "implausible":
        sums = sums * 1e12
    state = np.array([{"not whole": 1, "spike": 2}.get(kind, 0)], np.uint32)
    values = rng.standard_normal((len(layout.values), 1))
    epoch = RESTARTED if kind == "restarted" else EPOCH
    stamp_s = 1e9 + number * hop / RATE_HZ if axis == 1 else None
    batch = SpectraBatch(number * hop, sums, values, state, layout, RATE_HZ, epoch=epoch, stamp_s=stamp_s)
    message = write_message(batch)
    return message[:-1] + bytes([message[-1] ^ 1]) if kind == "damaged" else message


KINDS = ["lost", "repeated", "swapped", "not whole", "spike", "not finite", "implausible", "damaged", "restarted"]


@st.composite
def disturbed(draw: st.DrawFn) -> list[list[bytes]]:
    """Messages of each axis, some of them unusual."""
    found = []
    for axis in range(AXES):
        unusual = dict(draw(st.lists(st.tuples(st.integers(6, COUNT - 2), st.sampled_from(KINDS)), max_size=3)))
        messages = []
        for number in range(COUNT):
            kind = unusual.get(number, "whole")
            one = _message(axis, number, kind if kind not in KINDS[:3] else "whole")
            messages += [one] * {"lost": 0, "repeated": 2}.get(kind, 1)
            if kind == "swapped" and len(messages) > 1:
                messages[-2:] = messages[:-3:-1]
        found.append(messages)
    return found


class _AloneStream(AxisStream):
    """Reads each message and tracks it as one of samples is: no message is a usual one."""

    usual = property(lambda _: None, lambda *_: None)  # type: ignore[assignment]


def _bits(outputs: list[Output]) -> Any:
    """Everything that is stored of an axis, by the numbers of its responses."""
    rows, fits = {}, {}
    for output in outputs:
        if output.responses is not None:
            for i in range(len(output.responses)):
                each = [getattr(output.responses, name)[i].tobytes() for name in PER_LINE + PER_RESPONSE]
                assert output.number + i not in rows
                rows[output.number + i] = each
        for part in output.parameters:
            for i, number in enumerate(output.fitted):
                fits[int(number), part.names] = part.value[i].tobytes(), part.covariance[i].tobytes(), part.status[i]
    return rows, fits, sorted(repr(event) for output in outputs for event in output.events)


def _alone(number: int, messages: list[bytes]) -> Any:
    stream = _AloneStream(_axis(number), 1)
    found = _bits([stream.process(message, n, 1e9 + 0.05 * n) for n, message in enumerate(messages, 1)])
    return found, stream.snapshot()


ROUND = st.tuples(st.permutations(range(AXES)), st.integers(1, AXES), st.sampled_from([1, 1, 1, 2, 4]), st.booleans())


@given(disturbed(), st.lists(ROUND, min_size=4, max_size=20))
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.large_base_example, HealthCheck.too_slow])
def test_no_bit_of_an_axis_depends_on_the_others_on_the_cut_or_on_a_takeover(
    messages: list[list[bytes]], rounds: list[Any]
) -> None:
    streams = [AxisStream(_axis(number), 1) for number in range(AXES)]
    taken, restored = [0] * AXES, set()
    outputs: list[list[Output]] = [[] for _ in range(AXES)]
    ones = [(range(AXES), AXES, 1, False)] * (2 * COUNT)
    for order, some, count, takeover in [*ones[:6], *rounds, *ones]:
        chosen = order[:some]
        for i in chosen:
            for number in range(taken[i], min(taken[i] + count, len(messages[i]))):
                streams[i].add(messages[i][number], number + 1, 1e9 + 0.05 * (number + 1))
            taken[i] = min(taken[i] + count, len(messages[i]))
        for i, output in zip(chosen, outputs_together([streams[i] for i in chosen])):
            outputs[i].append(output)
        if takeover:
            i = chosen[0]
            restored.add(i)
            state, streams[i] = streams[i].snapshot(), AxisStream(_axis(i), 0)
            streams[i].restore(state)
    for i in range(AXES):
        bits, state = _alone(i, messages[i])
        assert _bits(outputs[i]) == bits
        assert i in restored or streams[i].snapshot() == state


def _streams(numbers: list[int], kind: type[AxisStream] = AxisStream) -> list[AxisStream]:
    """Streams after their first messages, when usual ones follow."""
    found = [kind(_axis(number), 1) for number in numbers]
    for number, stream in zip(numbers, found):
        for n in range(12):
            stream.process(_message(number, n), n + 1, 1e9 + 0.05 * n)
    return found


def _next(numbers: list[int], streams: list[AxisStream], n: int = 12, kinds: dict[int, str] | None = None) -> None:
    for number, stream in zip(numbers, streams):
        stream.add(_message(number, n, (kinds or {}).get(number, "whole")), n + 1, 1e9 + 0.05 * n)


def test_spectra_in_the_unit_of_a_drive_are_those_in_si_units_also_when_axes_are_tracked_together() -> None:
    streams = [AxisStream(_axis(number), 1) for number in (0, 7)]
    found: list[list[Responses]] = [[], []]
    for n in range(COUNT):
        for stream in streams:
            stream.add(_message(0, n), n + 1, 1e9 + 0.05 * n)
        for i, output in enumerate(outputs_together(streams)):
            found[i] += [] if output.responses is None else [output.responses]
    plain, scaled = map(Responses.join, found)
    assert len(plain) == len(scaled) > COUNT // 2
    np.testing.assert_allclose(scaled.value, plain.value / 0.5, rtol=1e-12)
    np.testing.assert_allclose(scaled.coherence, plain.coherence, rtol=1e-9)


def test_axes_that_are_alike_are_one_stack_and_their_rows_are_stored_as_those_of_one_axis() -> None:
    numbers = [0, 1, 2, 4, 5, 6]
    streams, alone = _streams(numbers), _streams(numbers, _AloneStream)
    _next(numbers, streams)
    _next(numbers, alone)
    stacks, outputs = stacked_together(streams)
    assert [stack.indices for stack in stacks] == [[0, 1], [3, 4]]
    assert sorted(outputs) == [2, 5]  # an average, which is tested for changes, and one that is fitted
    tables = []
    for found, rows, others in [(streams, stacks, outputs), (alone, [], dict(enumerate(outputs_together(alone))))]:
        pending = PendingResults()
        for stack in rows:
            keys = [f"axis {numbers[i]}" for i in stack.indices]
            pending.add_rows(keys, [found[i] for i in stack.indices], stack)
        for i, output in others.items():
            pending.add(f"axis {numbers[i]}", found[i], output)
        message = pending.message(1, "owner")
        tables.append(
            (repr(message.rows.sort_by("axis").to_pylist()), message.grids, message.recipes, message.logged_s)
        )
    assert tables[0] == tables[1]


@pytest.mark.parametrize("kind", ["not finite", "implausible", "spike"])
def test_an_unusual_spectrum_leaves_the_stack_alone(kind: str) -> None:
    streams = _streams([0, 1])
    _next([0, 1], streams, kinds={1: kind})
    (stack,), outputs = stacked_together(streams)
    assert stack.indices == [0]
    assert [event.kind for event in outputs[1].events] == [{"not finite": "not-whole"}.get(kind, kind)]


def test_an_axis_whose_tracking_raises_fails_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    streams, alone = _streams([0, 1, 0]), _streams([0, 1, 0], _AloneStream)
    for stream in (streams[1], alone[1]):
        assert stream._pipeline is not None
        monkeypatch.setattr(stream._pipeline.follower, "_range", None)  # an error of the program
    _next([0, 1, 0], streams)
    _next([0, 1, 0], alone)
    found, expected = outputs_together(streams), outputs_together(alone)
    assert [_bits([one]) for one in found] == [_bits([one]) for one in expected]
    assert [bool(stream.failure) for stream in streams] == [False, True, False]
    assert [len(one.responses or ()) for one in found] == [1, 0, 1]


def test_trackers_of_other_settings_are_of_another_kind() -> None:
    kinds = [
        stream.usual.kind[0] for stream in _streams(list(range(AXES))) if stream.usual is not None
    ]  # not of 2 and 3, whose averages are tested for changes, nor of 7, whose messages are read
    assert len(kinds) == AXES - 3
    assert len(set(kinds)) == 3
    assert kinds[0] is kinds[1]


def test_axes_with_several_spectra_are_stacked_one_spectrum_after_the_other() -> None:
    streams = _streams([0, 1, 2])
    for n in (12, 13, 14):
        _next([0, 1, 2], streams, n)
    _next([0], streams, 15)
    stacks, outputs = stacked_together(streams)
    assert [stack.indices for stack in stacks] == [[0, 1], [0, 1], [0, 1], [0]]
    assert [stack.numbers[0] for stack in stacks] == [12, 13, 14, 15]
    assert list(outputs) == [2]
    assert outputs[2].responses is not None
    assert len(outputs[2].responses) == 3


def test_rows_of_one_stack_join_to_the_responses_of_an_axis() -> None:
    streams = _streams([0, 1])
    parts = []
    for n in range(12, 15):
        _next([0, 1], streams, n)
        parts.append(outputs_together(streams)[1].responses)
    joined = Responses.join([part for part in parts if part is not None])
    assert np.diff(joined.sample).tolist() == [25, 25]


def test_what_owners_of_spectra_store_is_what_one_axis_after_the_other_gives(tmp_path: Path) -> None:
    axes = fleet_axes(12)
    with LogServer(tmp_path / "log", PARTITIONS) as server:
        settings = log_section(server.url)
        for part in (range(20), range(20, 40)):
            asyncio.run(_sent(settings, axes, part))
            owned_until_current(settings, axes)  # the second time others take over
        found = checked(settings, axes)
    assert found.exact
    assert found.total.responses == 40 * len(axes)


async def _sent(settings: LogSection, axes: Mapping[str, Axis], numbers: range) -> None:
    async with FleetLog(settings, "test") as log:
        await log.create_streams()
        for number in numbers:
            for key in axes:
                message = _message(
                    0, number, "spike" if number == 30 and key.startswith("ulm._.press%203") else "whole"
                )
                await log.append(f"{EDGE}.{key}", message, message_id(key, message))
