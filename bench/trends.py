"""Delay of a trend over 10,000 runs of 50 machines.

`python -m bench.trends` writes a lake with 8 quantities a run, in commits of 200 runs as an archive has them after
`compact`, and of 20 runs before it. It times the steps of `livebode archive trend` and of the report of the hall,
beside the same rows read by DuckDB and with least squares for each machine.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path

import duckdb
import numpy as np
import pyarrow as pa

from livebode_plant.lake import TABLES, Lake
from livebode_plant.trending import Selection, assess, histories, history
from livebode_plant.trending.machine_year import MachineYear

RUNS, MACHINES, QUANTITIES = 10_000, 50, 8
LIMIT_S = 2.0


def written(path: Path, commits: int) -> Lake:
    """A lake with these runs in so many commits."""
    lake, each = Lake(str(path)), RUNS // MACHINES
    rows, runs = [], []
    for machine in range(MACHINES):
        time_s, value, bound, covariates = MachineYear(runs=each).measured(machine)
        for i in range(each):
            own = {"content": sha256(f"{machine} {i}".encode()).hexdigest(), "recipe": "a" * 16, "site": "A"}
            own |= {"line": f"L{machine % 5}", "machine": f"M{machine:02}", "axis": "x"}
            own["recorded_from"] = datetime.fromtimestamp(time_s[i], UTC)
            runs.append(own)
            kelvin = [("temperature", float(covariates["temperature"][i]))]
            measured_one = {"model": "two-mass", "unit": "", "value": value[i], "bound_95": bound[i], "low": value[i]}
            rows.append(own | measured_one | {"high": value[i], "time_s": 4.0, "fits": 60, "covariates": kelvin})
    names = ["Keff", *(f"quantity {i}" for i in range(1, QUANTITIES))]
    for part in np.array_split(np.random.default_rng(0).permutation(RUNS), commits):
        own_rows = [rows[i] | {"name": name} for i in part for name in names]
        lake.add_rows("quantities", pa.Table.from_pylist(own_rows, TABLES["quantities"].schema))
        lake.add_rows("runs", pa.Table.from_pylist([runs[i] for i in part], TABLES["runs"].schema))
    return lake


def seconds(work: Callable[[], object]) -> float:
    """Shortest of five."""
    taken = []
    for _ in range(5):
        began = time.perf_counter()
        work()
        taken.append(time.perf_counter() - began)
    return min(taken)


def plain_slopes(path: Path) -> int:
    """What a script without bounds would do: SQL for the rows of a quantity, and least squares for each machine."""
    files = str(path / "tables" / "quantities" / "*.parquet")
    rows = duckdb.sql(f"SELECT machine, epoch(recorded_from) t, value FROM '{files}' WHERE name = 'Keff'").df()
    return len([np.polyfit(own["t"], own["value"], 1) for _, own in rows.groupby("machine")])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--commits", type=int, nargs="+", default=[50, 500])
    options = parser.parse_args()
    for commits in options.commits:
        with tempfile.TemporaryDirectory() as folder:
            result = measured(Path(folder), commits)
        print(f"{RUNS:,} runs of {MACHINES} machines in {commits} commits: {result}", flush=True)


def measured(folder: Path, commits: int) -> str:
    url = written(folder / "lake", commits).url
    found = history(Lake(url), "Keff", Selection())
    read = seconds(lambda: history(Lake(url), "Keff", Selection()))
    fitted = seconds(lambda: assess([found]))
    whole = seconds(lambda: assess([history(Lake(url), "Keff", Selection())]))
    hall = seconds(lambda: assess(histories(Lake(url), Selection(by="axis"))))
    plain = seconds(lambda: plain_slopes(Path(url)))
    return (
        f"read {read:.2f} s, trends {fitted:.2f} s, together {whole:.2f} s "
        f"({'met' if whole <= LIMIT_S else 'missed'}: {LIMIT_S:g} s), {whole / plain:.1f} × DuckDB and least squares; "
        f"all {QUANTITIES} quantities {hall:.2f} s"
    )


if __name__ == "__main__":
    main()
