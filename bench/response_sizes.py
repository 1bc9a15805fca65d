"""Bytes of a stored response: long as the run directory has it, and wide as an archive and a fleet have it.

`python -m bench.response_sizes`: a simulated belt axis that moves, with 1, 7, 21 and 101 lines in a window of 400 at
4 kHz and a response every 20 samples. All quantities, and value, sigma and coherence alone, which are what a Bode plot
needs. The last columns are processor times of one response. Then the same responses in the messages in which a fleet
stores results: rounded with a digest of the exact bits, in float64, and long.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from livebode.core import Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.records import RESPONSES, ColumnTable, as_batch
from livebode.records.segments.segment_writer import TableFile
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis, Strokes
from livebode.tables import Table
from livebode_plant.fleet.result_message import AxisRows, ResultMessage, grid_of, response_table
from livebode_plant.lake.wide_responses import from_wide, to_wide, wide_options

RATE_HZ, WINDOW, HOP, SECONDS = 4000.0, 400, 20, 60.0
COUNTS = 1, 7, 21, 101
AMPLITUDE_N_M, NOISE_RAD_PER_S = 0.3, 0.05
LEFT_OUT = {"weight_re", "weight_im", "input_coherence", "distortion", "variation"}
TARGET_WIDE, TARGET_LONG, TARGET_LINES = 85, 236, 7
AXES_IN_MESSAGE, EACH = 20, 8


def tracked(count: int) -> Responses:
    """Responses of the axis at this number of lines, from 20 Hz on."""
    lines = Lines(tuple(range(2, 2 + count)), WINDOW, RATE_HZ)
    axis = BeltAxis(
        excitation_n_m=multisine(lines, AMPLITUDE_N_M * (7 / count) ** 0.5),
        sensor=Sensor(noise_rad_per_s=NOISE_RAD_PER_S), motion=Strokes(), run_in_s=0.5, seconds=SECONDS,
    )  # fmt: skip
    block, _ = SimulatedAxis(axis).run()
    settings = Settings(lines=lines, excitation="w", input="u", output="velocity", schedule="x", hop=HOP)
    return Tracker(settings).process(block)


def long_bytes(responses: Responses, path: Path, left_out: set[str]) -> int:
    """Of the file that the run directory would have, without some columns."""
    batch = as_batch(responses)
    batch = batch.select([name for name in batch.column_names if name not in left_out])
    repeating = tuple(name for name in RESPONSES.repeating if name not in left_out)
    file = TableFile(path, ColumnTable(batch.schema, repeating))
    file.write(batch)
    file.close()
    return path.stat().st_size


def wide_bytes(table: pa.Table, path: Path, left_out: set[str]) -> int:
    kept = table.drop_columns(list(left_out))
    pq.write_table(kept, path, **wide_options(kept.schema))
    return path.stat().st_size


def found_of(responses: Responses) -> dict[str, object]:
    lines = responses.lines
    grid = {"bins": lines.bins, "quiet_bins": lines.quiet, "window": lines.window, "rate_hz": lines.rate_hz}
    return grid | {"quantity": responses.quantity, "unit": responses.unit}


def in_messages(responses: Responses) -> str:
    """Bytes of a response in a message of results of a partition with some axes, by form."""
    parts = [
        AxisRows.of(f"hall.2.machine {i}.x", 1, 0, responses[EACH * i : EACH * (i + 1)]) for i in range(AXES_IN_MESSAGE)
    ]
    grids = {part.axis: grid_of(part.responses) for part in parts}
    rounded = len(ResultMessage(1, "worker:1", rows=response_table(parts), grids=grids).to_bytes())
    exact = _packed(pa.concat_tables([to_wide(part.responses, lossless=True) for part in parts]))
    long = _packed(pa.table(Table.join([as_batch(part.responses) for part in parts])))
    sizes = (one / (EACH * AXES_IN_MESSAGE) for one in (rounded, exact, long))
    return "  ".join(f"{size:6.0f}" for size in sizes)


def _packed(table: pa.Table) -> int:
    sink = pa.BufferOutputStream()
    with (
        pa.CompressedOutputStream(sink, "zstd") as packed,
        pa.ipc.new_stream(packed, table.schema) as writer,
    ):
        writer.write_table(table.combine_chunks())
    return len(sink.getvalue())


def main() -> None:
    print("bytes of      all quantities             value, sigma, coherence    lossless    processor, µs")
    print("a response    long    wide  long/wide      long    wide  long/wide      wide    write    read")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "responses.parquet"
        for count in COUNTS:
            responses = tracked(count)
            wide_bytes(to_wide(responses), path, set())
            from_wide(pq.read_table(path), found_of(responses))  # both once before they are measured
            rows, row = len(responses), f"{count:4d} lines"
            for left_out in (set[str](), LEFT_OUT):
                long = long_bytes(responses, path, left_out) / rows
                wide = wide_bytes(to_wide(responses), path, left_out) / rows
                row += f"{long:8.0f} {wide:7.0f} {long / wide:9.2f}   "
            lossless = wide_bytes(to_wide(responses, lossless=True), path, set()) / rows
            began = time.process_time()
            wide_bytes(to_wide(responses), path, set())
            written = time.process_time()
            from_wide(pq.read_table(path), found_of(responses))
            read = time.process_time()
            print(f"{row}{lossless:7.0f} {1e6 * (written - began) / rows:8.1f} {1e6 * (read - written) / rows:7.1f}")
            if count == TARGET_LINES:
                message = in_messages(responses)
    print(f"in messages of a fleet at {TARGET_LINES} lines, with digest, float64, long: {message} B")
    print(f"target at {TARGET_LINES} lines: {TARGET_WIDE} B against {TARGET_LONG} B, {TARGET_LONG / TARGET_WIDE:.2f}")


if __name__ == "__main__":
    main()
