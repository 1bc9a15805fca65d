"""Raw samples around an alarm: those that were sent, with the sender's numbers, in a file that livebode reads."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from livebode_plant.fleet import sink
from livebode_plant.fleet.server import LogServer
from livebode_plant.lake import Lake
from tests.support.command import livebode
from tests.support.fleet_runs import (
    PARTITIONS,
    RATE_HZ,
    SAMPLES,
    batch,
    fleet_axes,
    log_section,
    owned_until_current,
    sent,
)
from tests.support.sinks import sink_once


@pytest.fixture
def server(tmp_path: Path) -> Iterator[LogServer]:
    with LogServer(tmp_path / "log", PARTITIONS) as one:
        yield one


def test_samples_around_an_alarm_are_saved_with_exact_numbers(
    server: LogServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sink, "_LATE_S", -2 * sink.AROUND_S)  # all of them are in the log already
    log, axes, lake = log_section(server.url), fleet_axes(2), tmp_path / "lake"
    key = next(iter(axes))
    signals = axes[key].signals.model_copy(update={"outputs": "missing"})
    sent(log, axes, 20)
    sent(log, axes, 20, 23)  # three batches are lost
    owned_until_current(log, axes | {key: axes[key].model_copy(update={"signals": signals})})
    for _ in range(2):
        sink_once(log, lake)
    (row,) = Lake(str(lake)).read("fleet_samples").to_pylist()
    assert (row["kind"], row["machine"], row["axis"]) == ("axis-failed", "press 0", "x")
    assert (row["first_sample"], row["samples"], row["missing"]) == (0, 40 * SAMPLES, 3 * SAMPLES)
    path = lake / row["file"]
    assert path.parent == lake / "fleet_alarm_samples" / "ulm" / "press 0" / "x"
    assert path.parent.parent.parent.parent.exists()
    table = pq.read_table(path)
    firsts = [*range(0, 20 * SAMPLES, SAMPLES), *range(23 * SAMPLES, 43 * SAMPLES, SAMPLES)]
    expected = np.concatenate([batch(0, first).data for first in firsts], axis=1)
    numbers = np.concatenate([np.arange(first, first + SAMPLES) for first in firsts])
    np.testing.assert_array_equal(table["sample"].to_numpy(), numbers)
    for name, values in zip(("w", "u", "y"), expected):
        np.testing.assert_array_equal(table[name].to_numpy(), values)
    assert json.loads(table.schema.metadata[b"livebode"])["machine"] == "ulm/press 0/x"
    found = json.loads(livebode("inspect", path, "--json").out)
    assert found["rate_hz"] == pytest.approx(RATE_HZ)
    tracked = ("--output", "y", "--input", "u", "--excitation", "w", "--lines", "20:100:20", "--window", "100")
    assert livebode("run", path, *tracked, "--out", tmp_path / "run").code == 0
