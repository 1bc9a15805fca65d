"""The main job without hardware: a recording is synthesised, then `livebode run` tracks it.

A tooth-belt axis (two masses under a velocity and position loop, Nevaranta 2016, Table I) stands still for 20 s with a
multisine on its torque reference and noise on its measured velocity. Halfway its belt loses 10 % of its stiffness.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

sys.path.insert(0, str(Path(__file__).parents[1]))

from examples.closed_loop import KEFF, RATE_HZ, Drive, Plant
from livebode.excitation import multisine
from livebode.nouns import Lines

WINDOW, SECONDS, NOISE_RAD_S = 800, 20, 0.1
LINES = Lines.parse("20:120:5", rate_hz=RATE_HZ, window=WINDOW)


def synthesise(path: Path) -> None:
    """Write the recording: excitation w and torque u in N m, velocity y in rad/s, at 4 kHz."""
    w = multisine(LINES, amplitude=0.5)
    rng = np.random.default_rng(1)
    healthy, worn = Drive(), Drive(Plant(keff=0.9 * KEFF))
    state = healthy.settled(w)[np.newaxis]
    total = SECONDS * int(RATE_HZ)
    noise = NOISE_RAD_S * rng.standard_normal(total)
    u, y = np.empty(total), np.empty(total)
    for n in range(total):
        drive = healthy if n < total // 2 else worn
        state, torque, velocity = drive.tick(state, w[n % WINDOW], noise[n], n)
        u[n], y[n] = torque[0], velocity[0]
    columns = {"w [N m]": np.tile(w, total // WINDOW), "u [N m]": u, "y [rad/s]": y}
    pq.write_table(pa.table({"t [s]": np.arange(total) / RATE_HZ} | columns), path)


def main() -> None:
    log = Path("runs/demo.parquet")
    log.parent.mkdir(exist_ok=True)
    print(f"No machine is at hand, so a recording of a simulated axis is synthesised: {SECONDS} s at {RATE_HZ:.0f} Hz.")
    print("Halfway its belt loses 10 % of its stiffness.\n")
    synthesise(log)
    command = ["livebode", "run", str(log), "--excitation", "w", "--input", "u", "--output", "y", "--force"]
    print("$", " ".join(command))
    subprocess.run([str(Path(sys.executable).with_name("livebode")), *command[1:]], check=True)
    print("See runs/demo/bode.png and runs/demo/tracking.png.")


if __name__ == "__main__":
    main()
