"""Bytes of a result in each tier of the lake that `livebode fleet sink` writes, and what storing costs.

`python -m bench.fleet_sink`: axes with seven lines, two responses a second each, for 50 minutes of the log; a
commit each minute, and the files of the earlier day joined as the sink does it at midnight. Beside them
the bytes in the log. The last line is processor time.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from livebode.core import Lines, Parameters, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis, Strokes
from livebode_plant.fleet.fleet_settings import SinkSection
from livebode_plant.fleet.reader import StoredMessage
from livebode_plant.fleet.result_message import (
    AxisFits,
    AxisRows,
    ResultMessage,
    grid_of,
    parameter_table,
    response_table,
)
from livebode_plant.fleet.sink_tables import SinkTables
from livebode_plant.lake import Lake

RATE_HZ, WINDOW, LINES, HOP, TRACKED_S = 4000.0, 400, 7, 2000, 60.0
AXES, SECONDS, EVERY_S, RESPONSES_PER_S = 10, 3000.0, 2.0, 2.0
COMMITTED = round(60 / EVERY_S)
SCATTER = 1e-2
SCATTERED = "value", "sigma", "coherence", "input_coherence", "distortion", "variation", "weight"
PARAMETERS = 2
BEGIN_S = 1.7e9
"""A day long ago, whose files are joined."""
TABLES = "fleet_responses", "fleet_responses_minute", "fleet_parameters", "fleet_parameters_minute"
"""Means over hours have the columns of those over minutes."""


@dataclass(frozen=True)
class SinkCosts:
    """Bytes of a row by table of the lake, and of a response in the log; seconds of the processor for a response."""

    row_bytes: dict[str, float]
    log_bytes: float
    response_s: float

    def bytes_of(self, tier: str = "") -> float:
        """Of a response with its fit at full rate, or of their means over a period such as "_minute"."""
        return self.row_bytes[f"fleet_responses{tier}"] + PARAMETERS * self.row_bytes[f"fleet_parameters{tier}"]


def tracked() -> Responses:
    """Responses of a simulated axis, two a second."""
    lines = Lines(tuple(range(2, 2 + LINES)), WINDOW, RATE_HZ)
    axis = BeltAxis(
        excitation_n_m=multisine(lines, 0.3), sensor=Sensor(noise_rad_per_s=0.05), motion=Strokes(), run_in_s=0.5,
        seconds=TRACKED_S,
    )  # fmt: skip
    block, _ = SimulatedAxis(axis).run()
    settings = Settings(lines=lines, excitation="w", input="u", output="velocity", schedule="x", hop=HOP)
    return Tracker(settings).process(block)


def messages(responses: Responses, axes: int, seconds: float) -> Iterator[StoredMessage]:
    """Messages of results of these axes; each response has scatter of its own, and two parameters."""
    rng = np.random.default_rng(1)
    grid, count = grid_of(responses), round(EVERY_S * RESPONSES_PER_S)
    keys = [f"ulm._.press%20{axis // 2}.{'xy'[axis % 2]}" for axis in range(axes)]
    for number in range(round(seconds / EVERY_S)):
        stored_s = BEGIN_S + number * EVERY_S
        parts, fits = [], []
        at = (number * count + np.arange(count)) % len(responses)
        for key in keys:
            own = responses[at]
            scattered = {
                name: getattr(own, name) * (1 + SCATTER * rng.standard_normal(own.value.shape)) for name in SCATTERED
            }
            own = replace(own, **scattered, time_s=number * EVERY_S + np.arange(count) / RESPONSES_PER_S)
            parts.append(AxisRows.of(key, 1, number * count, own))
            found = 1e5 * (1 + SCATTER * rng.standard_normal((count, PARAMETERS)))
            covariance = np.broadcast_to(1e4 * np.eye(2), (count, 2, 2)).copy()
            fitted = Parameters(
                "rigid", ("Keff", "mL"), ("N/m", "kg"), found, covariance, np.array(["ok"] * count), np.zeros(count),
                np.ones(count), np.ones(count), own.sample, own.time_s, own.schedule,
            )  # fmt: skip
            fits.append(AxisFits(key, 1, number * count + np.arange(count), fitted))
        message = ResultMessage(
            number, "bench", rows=response_table(parts), parameters=parameter_table(fits),
            recipes=dict.fromkeys(keys, "0123456789abcdef"), grids=dict.fromkeys(keys, grid),
            logged_s=dict.fromkeys(keys, stored_s - 0.1),
        )  # fmt: skip
        yield StoredMessage("res.0", number + 1, message.to_bytes(), "", stored_s)


def measured(axes: int = AXES, seconds: float = SECONDS) -> SinkCosts:
    """Store the messages in a lake of a temporary directory, and count bytes by table."""
    with tempfile.TemporaryDirectory() as folder:
        everything = list(messages(tracked(), axes, seconds))
        tables = SinkTables(SinkSection(lake=folder, full_rate_days=1e5, minute_days=1e5, commit_s=1e9))
        tables.resume(BEGIN_S)
        began_s = time.process_time()
        for first in range(0, len(everything), COMMITTED):
            tables.process(everything[first : first + COMMITTED])
            tables.commit()
        spent_s = time.process_time() - began_s
        tables.clean()
        lake = Lake(folder)
        sizes = {}
        for name in TABLES:
            table = lake.opened(name)
            assert table is not None
            files = [Path(folder, name, uri.rpartition("/")[2]) for uri in table.file_uris()]
            sizes[name] = sum(file.stat().st_size for file in files) / max(1, lake.read(name, ["run"]).num_rows)
        log_bytes = sum(len(message.data) for message in everything) / tables.totals.responses
        return SinkCosts(sizes, log_bytes, spent_s / tables.totals.responses)


def main() -> None:
    """Measure, and print the table."""
    costs = measured()
    print(f"{AXES} axes, {LINES} lines, {RESPONSES_PER_S:g} responses and fits a second, {SECONDS / 60:g} minutes")
    print(f"in the log: {costs.log_bytes:.0f} B a response with its fit")
    print("| table | B a row |\n|---|---|")
    for name in TABLES:
        print(f"| {name} | {costs.row_bytes[name]:.0f} |")
    print(f"processor time: {costs.response_s * 1e6:.0f} µs a response, {1 / costs.response_s:,.0f} responses a second")


if __name__ == "__main__":
    main()
