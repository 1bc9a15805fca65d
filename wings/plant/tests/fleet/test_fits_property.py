"""Fits of many axes at once: no bit of an axis depends on the others, on the cut of its messages, or on a takeover."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from livebode.configuration import Axis
from livebode.core import Responses
from livebode_plant.fleet.alike_axes import Output, outputs_together
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.result_message import PendingResults, ResultMessage
from livebode_plant.fleet.status_message import (
    ACTIVE,
    KINDS,
    PRIORITIES,
    STATES,
    PageStatus,
    PartitionNames,
    PartitionStatus,
    decode,
)
from livebode_plant.lake.wide_responses import from_wide
from tests.support.fitted_fleet import fitted_axes, fitted_message, healthy_baseline

AXES, BATCHES = 3, 16
MESSAGES = [[fitted_message(axis, number) for number in range(BATCHES)] for axis in range(AXES)]


@pytest.fixture(scope="module")
def axes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Axis]:
    return fitted_axes(AXES, healthy_baseline(tmp_path_factory.mktemp("baseline")))


@pytest.fixture(scope="module")
def alone(axes: dict[str, Axis]) -> list[Any]:
    return [_alone(axis, messages) for axis, messages in zip(axes.values(), MESSAGES)]


def _alone(axis: Axis, messages: list[bytes]) -> Any:
    stream = AxisStream(axis, 1)
    return _bits([stream.process(message, n, 1e9 + 0.1 * n) for n, message in enumerate(messages, 1)])


def _bits(outputs: list[Output]) -> Any:
    """Everything that is stored of an axis: bits of its fits by their numbers, and its events."""
    rows: dict[tuple[int, str], tuple[Any, ...]] = {}
    for output in outputs:
        for part in output.parameters:
            for i, number in enumerate(output.fitted):
                name = (int(number), "/".join(part.names))
                rows[name] = part.value[i].tobytes(), part.covariance[i].tobytes(), str(part.status[i])
                rows[name] += (part.epsilon[i].tobytes(), int(part.sample[i]))
    return rows, sorted(repr(event) for output in outputs for event in output.events)


ROUND = st.tuples(st.permutations(range(AXES)), st.integers(1, AXES), st.integers(1, 9), st.booleans())


@given(rounds=st.lists(ROUND, min_size=2, max_size=10))
@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.large_base_example])
def test_batch_cut_and_takeover_change_no_bit(axes: dict[str, Axis], alone: list[Any], rounds: list[Any]) -> None:
    configured = list(axes.values())
    streams = [AxisStream(axis, 1) for axis in configured]
    taken = [0] * AXES
    outputs: list[list[Output]] = [[] for _ in range(AXES)]
    for order, some, count, takeover in [*rounds, (range(AXES), AXES, BATCHES, False)]:
        chosen = order[:some]
        for i in chosen:
            for number in range(taken[i], min(taken[i] + count, BATCHES)):
                streams[i].add(MESSAGES[i][number], number + 1, 1e9 + 0.1 * (number + 1))
            taken[i] = min(taken[i] + count, BATCHES)
        for i, output in zip(chosen, outputs_together([streams[i] for i in chosen])):
            outputs[i].append(output)
        if takeover:
            state, streams[0] = streams[0].snapshot(), AxisStream(configured[0], 0)
            streams[0].restore(state)
    for i in range(AXES):
        assert _bits(outputs[i]) == alone[i]


def test_the_fits_are_two_a_second_and_have_derived_quantities_and_margins(alone: list[Any]) -> None:
    rows, events = alone[0]
    numbers = sorted({number for number, _ in rows})
    assert np.all(np.diff(numbers) == 20)
    assert len(numbers) == 3
    assert any(name.startswith("Js/") for _, name in rows)
    assert any("resonance" in name for _, name in rows)
    assert any("margin" in name for _, name in rows)
    assert sum("kind='change'" in event for event in events) == 1
    assert not any("kind='change'" in event for event in alone[1][1])


def test_a_stored_message_gives_responses_and_parameters_back(axes: dict[str, Axis]) -> None:
    pending, responses = PendingResults(), {}
    for (key, axis), messages in zip(axes.items(), MESSAGES):
        stream = AxisStream(axis, 1)
        outputs = [stream.process(message, n, 1e9 + 0.1 * n) for n, message in enumerate(messages, 1)]
        for output in outputs:
            pending.add(key, stream, output)
        responses[key] = Responses.join([one.responses for one in outputs if one.responses is not None])
    found = ResultMessage.from_bytes(pending.message(BATCHES, "a:1").to_bytes())
    for key, expected in responses.items():
        mask = np.array(found.rows["axis"].to_pylist()) == key
        back = from_wide(found.rows.filter(mask), found.grids[key])
        np.testing.assert_allclose(back.value, expected.value, rtol=1e-6)
        np.testing.assert_array_equal(back.sample, expected.sample)
        names = {row["name"] for row in found.parameters.to_pylist() if row["axis"] == key}
        assert {"Js", "Keff", "resonance"} <= names


def test_the_page_shows_value_bound_and_change_and_a_takeover_raises_no_alarm_again(axes: dict[str, Axis]) -> None:
    streams = {key: AxisStream(axis, 1) for key, axis in axes.items()}
    for n in range(BATCHES):
        for stream, messages in zip(streams.values(), MESSAGES):
            stream.add(messages[n], n + 1, 1e9 + 0.1 * n)
        outputs_together([*streams.values()])
    names, status = _page(streams)
    assert {(one.parameter, one.unit) for one in names.axes} == {("Js", "kg m²")}
    first, second = status.axes[0], status.axes[1]
    assert second["value"] == pytest.approx(0.0028, rel=0.02)
    assert 0 < second["bound"] < 0.001
    assert first["change_percent"] == pytest.approx(-100 * (1 - 1 / 1.2), abs=3)
    assert abs(second["change_percent"]) < 3
    assert (STATES[first["state"]], PRIORITIES[first["priority"]]) == ("alarm", "high")
    assert KINDS[first["kind"]] == "change"
    assert first["flags"] & ACTIVE
    assert first["raised"] == 1
    assert (STATES[second["state"]], second["raised"]) == ("ok", 0)
    again = {key: AxisStream(axis, 0) for key, axis in axes.items()}
    for stream, before in zip(again.values(), streams.values()):
        stream.restore(before.snapshot())
    after = _page(again)[1].axes[0]
    assert [after[name] for name in ("state", "kind", "priority", "raised", "raised_s")] == [
        first[name] for name in ("state", "kind", "priority", "raised", "raised_s")
    ]


def _page(streams: dict[str, AxisStream]) -> tuple[PartitionNames, PartitionStatus]:
    (_, names), (_, status) = PageStatus(0, "a:1").messages(streams, 1e9 + 2, 0, 0.0)
    found = decode(names), decode(status)
    assert isinstance(found[0], PartitionNames)
    assert isinstance(found[1], PartitionStatus)
    return found[0], found[1]
