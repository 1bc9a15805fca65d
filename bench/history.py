"""The stored figures of each release: `bench/history/VERSION.json`.

Ratios to other software were measured side by side in one run, so they may be read across computers; times may not.
Nothing in a file names a computer. `python -m bench.versions` compares two versions of livebode by running both, for
figures that were stored on different days differ by up to 5 % without any change.
"""

from __future__ import annotations

import datetime
import json
import os
import platform
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from livebode import __version__
from livebode.kernel import instruction_sets

FOLDER = Path(__file__).parent / "history"
ROWS = 4096
Figure = dict[str, str | float]


def figure(name: str, value: float, unit: str, better: str = "less") -> Figure:
    return {"name": name, "value": float(f"{value:.4g}"), "unit": unit, "better": better}


def of_kernel(result: dict[str, Any]) -> list[Figure]:
    """Ratios to the other programs, and livebode's own times, of each instruction set and cell."""
    found = []
    for name, run in result.items():
        for line in run["judged"]:
            label = f"{name}: {line['question']}, N = {line['window']}, K = {line['bins']}"
            found.append(figure(label, line["ratio"], "×", "more" if line["more_is_better"] else "less"))
        for record in run["records"]:
            blocks = record["kind"] in ("dense", "hop 20")
            ns = record["seconds"]["livebode"] / (ROWS if blocks else 1) * 1e9
            label = f"{name}: {record['kind']}, N = {record['window']}, K = {record['bins']}"
            found.append(figure(label, ns, "ns per row" if blocks else "ns per sample"))
    return found


def of_felt(rows: list[Any]) -> list[Figure]:
    """What a person waits for, and the scripts of SciPy, from the JSON of `python -m bench.felt`."""
    return [figure(what, value, unit) for what, figures in rows for value, unit, _ in figures]


def processor_family(model: str) -> str:
    """The words of a processor's name, without its numbers.

    >>> processor_family("Intel(R) Xeon(R) Platinum 8000 CPU @ 2.00GHz")
    'Intel Xeon Platinum'
    """
    words = re.sub(r"\([^)]*\)|@.*", " ", model).split()
    return " ".join(word for word in words if word.isalpha() and word not in ("CPU", "Processor"))


def commit() -> str:
    done = subprocess.run(["git", "rev-parse", "--short=12", "HEAD"], cwd=FOLDER.parent, capture_output=True, text=True)
    return done.stdout.strip()


def document(figures: list[Figure], processor: str) -> dict[str, Any]:
    return {
        "livebode": __version__,
        "commit": commit(),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "processor": processor_family(processor),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "load_average": round(os.getloadavg()[1], 2),
        "instruction_sets": list(instruction_sets()),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "figures": figures,
    }


def newest() -> dict[str, Any]:
    """The stored document with the latest date."""
    documents = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.json"))]
    if not documents:
        raise SystemExit("bench/history has no stored result; name the commit to compare with: --base REV")
    return dict(max(documents, key=lambda found: found["date"]))
