"""`python -m tests.support.oma_answers > wings/modes/tests/stored/pyoma2.json`: the answers of pyOMA2 on seeded data.

Needs `pip install pyOMA_2==1.4.3 scipy`, in an environment of its own: it needs a newer pandas than livebode's tests.
"""

from __future__ import annotations

import contextlib
import json
import sys
from importlib.metadata import version

import numpy as np

from tests.support.ringing import RATE_HZ, two_modes

SEEDS, SAMPLES, ROWS, HOPS, ORDER = (1, 2, 3), 4051, 26, 20, 4


def answers() -> str:
    """Frequency, damping and their standard deviations of the model of order 4, one and two outputs, as JSON."""
    from pyoma2.functions import ssi  # type: ignore[import-not-found]

    rows = []
    for outputs in (1, 2):
        for seed in SEEDS:
            y = two_modes(seed, SAMPLES, outputs)
            y -= y.mean(axis=1, keepdims=True)
            with contextlib.redirect_stdout(sys.stderr):
                matrix, scatter = ssi.build_hank(y, y, ROWS, "cov", calc_unc=True, nb=HOPS)
                observability, a, c = ssi.SSI(matrix, ROWS, ORDER, step=2)
                found = ssi.SSI_poles(
                    observability, a, c, ORDER, 1 / RATE_HZ, step=2, HC=False, calc_unc=True, H=matrix, T=scatter
                )
            f, z, _, _, f_sigma, z_sigma, *_ = (np.asarray(part) for part in found)
            for i in np.argsort(f[:, -1])[::2]:
                values = (f[i, -1], f_sigma[i, -1], z[i, -1], z_sigma[i, -1])
                rows.append(json.dumps([outputs, seed, *(round(float(value), 9) for value in values)]))
    columns = ["outputs", "seed", "frequency_hz", "frequency_sigma", "damping", "damping_sigma"]
    head = f' "pyOMA_2": "{version("pyOMA_2")}",\n "columns": {json.dumps(columns)},\n "rows": [\n  '
    return "{\n" + head + ",\n  ".join(rows) + "\n ]\n}"


if __name__ == "__main__":
    print(answers())
