"""`python -m bench`: the kernel compared with its alternatives, all in one run.

With --long: the error over 1e9 samples; with --accuracy: the error of the named variants; with --record: the cost of a
record in segments. With --json FILE: kernel and what a person waits for, stored with version and environment
(bench/history has one file for each release).
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from bench import history, native_build
from bench.accuracy import accuracy
from bench.long import long_run
from livebode.kernel import instruction_sets

RESULTS = Path(__file__).parent / "results"


def speed(seconds: float, sets: list[str]) -> dict[str, Any]:
    from bench import blocks, push, rls, targets

    native_build.build()
    found: dict[str, Any] = {}
    for name in sets:
        os.environ["LIVEBODE_INSTRUCTION_SET"] = name
        print(f"running with {name} …", flush=True)
        records = blocks.measure(seconds) + push.measure(seconds) + rls.measure(seconds)
        lines = targets.judge(records, name)
        targets.show_times(records)
        targets.show(lines, name)
        found[name] = {"records": records, "judged": lines}
    os.environ.pop("LIVEBODE_INSTRUCTION_SET", None)
    missed = [line for run in found.values() for line in run["judged"] if line["reached"] is False]
    print(f"\n{len(missed)} cells missed their target")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("--long", action="store_true", help="measure the error over 1e9 samples, instead of speed")
    parser.add_argument("--samples", type=float, default=1e9, help="length of the long run")
    parser.add_argument(
        "--accuracy", action="store_true", help="measure the error of the named variants, instead of speed"
    )
    parser.add_argument(
        "--record", action="store_true", help="measure the cost of a record in segments, instead of the kernel"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="store here what bench.felt and the kernel measure")
    parser.add_argument("--seconds", type=float, default=0.5, help="duration per contender and cell")
    parser.add_argument("--sets", nargs="+", default=list(instruction_sets()[1:]) or list(instruction_sets()))
    options = parser.parse_args()
    if options.json:
        store(options.json, options.seconds, options.sets)
        return
    result: dict[str, Any]
    if options.long:
        name, result = "long", dict(long_run(int(options.samples)))
    elif options.accuracy:
        name, result = "accuracy", dict(accuracy())
    elif options.record:
        from bench import record

        name, result = "record", dict(record.measure())
        record.report(result)
    else:
        name, result = "kernel", speed(options.seconds, options.sets)
    RESULTS.mkdir(exist_ok=True)
    machine = {"machine": platform.machine(), "processor": processor(), "python": platform.python_version()}
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps({"when": time.time(), **machine, "result": result}, indent=1), encoding="utf-8")
    print(f"written to {path}")


def store(path: Path, seconds: float, sets: list[str]) -> None:
    """Measure what a release's figures are, and write them."""
    with tempfile.TemporaryDirectory() as folder:  # in a process of its own, whose memory is not that of this one
        rows = Path(folder) / "rows.json"
        subprocess.run([sys.executable, "-m", "bench.felt", "--json", str(rows)], check=True)
        felt = json.loads(rows.read_text(encoding="utf-8"))
    figures = [*history.of_felt(felt), *history.of_kernel(speed(seconds, sets))]
    document = history.document(figures, processor())
    path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"written to {path}")


def processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name")), "")


if __name__ == "__main__":
    main()
