"""An axis that cannot be tracked, or whose fit raises, fails alone: the others of its partition are tracked."""

from __future__ import annotations

import asyncio
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.core import FleetError
from livebode.fitting import Fitter, problem, rows
from livebode.runtime import Fits
from livebode_plant.fleet.alike_axes import Output, outputs_together
from livebode_plant.fleet.axis_stream import AxisStream
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.reader import stored_messages
from livebode_plant.fleet.replay import replayed
from livebode_plant.fleet.result_message import ResultMessage
from livebode_plant.fleet.server import LogServer
from livebode_plant.fleet.status import fleet_status
from livebode_plant.fleet.subjects import RESULT_STREAM, RESULTS, axis_path
from tests.support.fitted_fleet import fitted_axes, fitted_message, fitted_sent, healthy_baseline
from tests.support.fleet_runs import PARTITIONS, checked, log_section, owned_until_current


def test_an_axis_whose_baseline_is_absent_or_damaged_fails_alone_and_begins_again_with_it(tmp_path: Path) -> None:
    healthy = healthy_baseline(tmp_path)
    own = tmp_path / "own.json"
    axes = fitted_axes(2, healthy)
    bad, other = axes
    axes[bad] = fitted_axes(1, own)[bad]
    with LogServer(tmp_path / "log", PARTITIONS) as server:
        settings = log_section(server.url)
        found = []
        for part in range(3):
            if part == 1:
                with pytest.raises(FleetError, match=r"cannot be tracked: .*own\.json"):
                    asyncio.run(_replayed(settings, bad, axes[bad]))
                own.write_text('{"format": ')
            if part == 2:
                shutil.copy(healthy, own)
            fitted_sent(settings, axes, range(10 * part, 10 * part + 10))
            owned_until_current(settings, axes)
            status = asyncio.run(_status(settings, axes))
            found.append({axis["axis"]: axis for axis in status["axes"]})
            assert any(axis_path(bad) in alarm for alarm in status["alarms"]) == (part < 2)
            assert checked(settings, axes).exact
        kinds = [event["kind"] for event in asyncio.run(_events(settings)) if event["axis"] == bad]
    absent, damaged, repaired = (one[axis_path(bad)] for one in found)
    assert "own.json" in absent["failure"]
    assert "own.json" in damaged["failure"]
    assert (absent["responses"], damaged["responses"], repaired["failure"]) == (0, 0, "")
    assert repaired["responses"] > 0
    assert [one[axis_path(other)]["responses"] for one in found] == [40, 80, 120]
    assert [kind for kind in kinds if kind in ("axis-failed", "state-rejected")] == [
        "axis-failed", "state-rejected", "axis-failed", "state-rejected",
    ]  # fmt: skip


AXES, BATCHES = 3, 12


def _streams() -> dict[int, AxisStream]:
    return {number: AxisStream(axis, 1) for number, axis in enumerate(fitted_axes(AXES).values())}


def _outputs(streams: dict[int, AxisStream]) -> list[Output]:
    for axis, stream in streams.items():
        for n in range(BATCHES):
            stream.add(fitted_message(axis, n), n + 1, 1e9 + 0.1 * n)
    return outputs_together([*streams.values()])


def _bits(output: Output) -> Any:
    assert output.responses is not None
    fits = [(one.value.tobytes(), one.covariance.tobytes(), list(one.status)) for one in output.parameters]
    return output.responses.value.tobytes(), fits, output.fitted.tolist(), [repr(event) for event in output.events]


def test_a_row_without_a_solution_is_one_that_did_not_converge_and_changes_no_bit_of_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # No input of the estimator is known to make NumPy raise here, so the first row of the second axis does. The kernel,
    # which fits each row by itself, does not take part.
    monkeypatch.setattr(problem, "native_model", lambda *_: None)
    alone = [_outputs({axis: stream})[0] for axis, stream in _streams().items()]
    responses = alone[1].responses
    assert responses is not None
    marked = responses.value[alone[1].fitted[0]]
    original = rows._fitted

    def raising(problem: Any, measured: Any, *arguments: Any) -> Any:
        if (measured.value == marked).all(axis=1).any():
            raise np.linalg.LinAlgError("Singular matrix")
        return original(problem, measured, *arguments)

    monkeypatch.setattr(rows, "_fitted", raising)
    found = _outputs(_streams())
    assert [_bits(found[i]) for i in (0, 2)] == [_bits(alone[i]) for i in (0, 2)]
    assert list(found[1].parameters[0].status)[:2] == ["not converged", "ok"]
    assert [event.kind for event in found[1].events] == ["fit-failed", "fit-resumed"]


@pytest.mark.parametrize("stage", ["task", "around"])
def test_an_axis_whose_fit_raises_fails_and_changes_no_bit_of_others(
    monkeypatch: pytest.MonkeyPatch, stage: str
) -> None:
    # An error of the program: there is no input for it.
    alone = [_outputs({axis: stream})[0] for axis, stream in _streams().items()]
    streams = _streams()
    place: Any = Fits if stage == "around" else Fitter
    original = getattr(place, stage)
    bad = alone[1].responses
    assert bad is not None
    marked = bad.value[alone[1].fitted[0]]

    def raising(self: Any, *arguments: Any) -> Any:
        if len(arguments[-1]) and (arguments[-1].value == marked).all(axis=1).any():
            raise RuntimeError("an error of the program")
        return original(self, *arguments)

    monkeypatch.setattr(place, stage, raising)
    found = _outputs(streams)
    assert [_bits(found[i]) for i in (0, 2)] == [_bits(alone[i]) for i in (0, 2)]
    assert [stream.failure for stream in streams.values()] == ["", "an error of the program", ""]
    assert [event.kind for event in found[1].events][-1] == "axis-failed"
    assert _outputs({1: streams[1]})[0].responses is None


async def _status(settings: LogSection, axes: Any) -> dict[str, Any]:
    async with FleetLog(settings, "test") as log:
        return await fleet_status(log, axes)


async def _replayed(settings: LogSection, key: str, axis: Any) -> None:
    async with FleetLog(settings, "test") as log:
        await replayed(log, key, axis, 0.0)


async def _events(settings: LogSection) -> list[dict[str, Any]]:
    async with FleetLog(settings, "test") as log:
        last = (await log.extent(RESULT_STREAM)).last
        found = [
            ResultMessage.from_bytes(one.data)
            async for one in stored_messages(log, RESULT_STREAM, f"{RESULTS}.*", last)
        ]
    return [dict(event) for message in found for event in message.events]
