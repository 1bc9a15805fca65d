"""Cost of the content's SHA-256 in a run: `python -m bench.content`, ten minutes at 4 kHz in Parquet and in CSV."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pc
import pyarrow.parquet as pq

from bench.job import RATE_HZ, best_s, run_livebode, signals
from livebode.records import content_sha256


def main() -> None:
    w, u, y = signals()
    table = pa.table({"t [s]": np.arange(w.size) / RATE_HZ, "w [N m]": w, "u [N m]": u, "y [rad/s]": y})
    print("file        MB   `livebode run`, s   SHA-256, s   share of the run")
    with tempfile.TemporaryDirectory() as folder:
        for name, write in (("a.parquet", pq.write_table), ("a.csv", pc.write_csv)):
            log = Path(folder) / name
            write(table, log)
            run_s, hash_s = run_livebode(log, Path(folder) / "run")["run_s"], best_s(partial(content_sha256, log), 3)
            print(f"{name:10s}{log.stat().st_size / 1e6:5.0f} {run_s:18.2f} {hash_s:12.3f} {hash_s / run_s:18.1%}")


if __name__ == "__main__":
    main()
