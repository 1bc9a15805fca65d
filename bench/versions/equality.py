"""`python -m bench.versions.equality --base REV`: what commands print and write, of this version and of another commit.

Each version runs `COMMANDS` in a directory of the same name, so that paths in results are the same. The base runs them
twice: what differs between its own two runs (times of day, durations, names of temporary files) is not compared. What
is compared are the facts of each file: the values of a JSON document by their keys, the columns of a table, the lines
of a text, and otherwise the bytes.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shlex
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from bench.versions.__main__ import environment
from bench.versions.installed import archived, commit_of, installed, working_tree

COMMANDS = """
example all --out example
run example/standstill.toml --out runs/standstill
run example/moving.toml --out runs/moving
run example/chirp.toml --out runs/chirp
run example/loop.toml --out runs/loop
run example/tune.toml --out runs/tune
run example/monday.toml --out runs/monday
run example/tuesday.toml --out runs/tuesday
run example/ambient.toml --out runs/ambient
run example/gantry.toml --out runs/gantry
run example/gantry-2.toml --out runs/gantry-2
run example/gantry-tune.toml --out runs/gantry-tune
inspect example/standstill.csv
inspect example/standstill.csv --excitation w --json
new example/moving.parquet --out new.toml --yes --excitation w --input u --output velocity --schedule x \
=> inspect example/moving.parquet --out new.toml --yes --excitation w --input u --output velocity --schedule x
fit runs/standstill --model two-mass --json
fit runs/moving --model two-mass
fit runs/gantry
margins runs/loop
margins runs/loop --json
validate runs/standstill --on example/standstill-2.csv
check-loop runs/tune => validate runs/tune --loop
tune runs/tune --loop-checked
shaper runs/tune => tune runs/tune --shaper
friction example/strokes.toml --json
orders example/strokes.toml
learn runs/monday runs/tuesday --out axis.baseline
run example/today.toml --out runs/today --baseline axis.baseline
compare runs/monday runs/today --out comparison
compare runs/gantry runs/gantry-2 --json
report runs/standstill --template example/acceptance.toml
report runs/gantry
export runs/ambient --parameters --to csv --out modes.csv
query runs/moving "SELECT count(*), min(frequency_hz), max(time_s) FROM responses" \
=> export runs/moving --sql "SELECT count(*), min(frequency_hz), max(time_s) FROM responses"
export runs/moving --to csv --out moving.csv
export runs/standstill --to mat --out standstill.mat
design example/experiment.toml --out designs/belt
design example/several-motors.toml --out designs/gantry
plc example/moving.toml --limit 2 --amplitude 0.1 --rate 4000 --out plc
archive run example/archive.toml
schema axis => doctor --schema axis
doctor example/standstill.toml
"""


def commands(now: bool) -> dict[str, list[str]]:
    """Words of each command by number and first word; a line `OLD => NEW` is a command that has another name now."""
    lines = [line.split(" => ") for line in COMMANDS.strip().splitlines()]
    return {f"{i:02} {line[0].split()[0]}": shlex.split(line[-1 if now else 0]) for i, line in enumerate(lines)}


def perform(python: Path, work: Path, lines: dict[str, list[str]]) -> None:
    """Run the commands in a new directory, and keep what each prints in its file of `printed`."""
    (work / "printed").mkdir(parents=True)
    settings = environment() | {"COLUMNS": "100", "TZ": "UTC", "SOURCE_DATE_EPOCH": "1700000000"}
    for name, words in lines.items():
        done = subprocess.run([python.parent / "livebode", *words], cwd=work, env=settings, capture_output=True)
        text = done.stdout + b"--- standard error\n" + done.stderr + f"--- exit code {done.returncode}\n".encode()
        (work / "printed" / f"{name}.txt").write_bytes(text)


def facts(path: Path) -> dict[str, Any]:
    """What a file says, by name."""
    data = path.read_bytes()
    if path.suffix == ".parquet":
        table = pq.read_table(path)
        columns = {name: _digest(repr(table[name].to_pylist()).encode()) for name in table.column_names}
        return {f"column {name}": value for name, value in columns.items()} | {"bytes": _digest(data)}
    try:
        text = data.decode()
        if path.suffix == ".json":
            return dict(_leaves(json.loads(text)))
        if path.suffix == ".jsonl":
            return dict(_leaves([json.loads(line) for line in text.splitlines()]))
        return {f"line {number}": line for number, line in enumerate(text.splitlines(), 1)}
    except ValueError:
        return {"bytes": _digest(data)}


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _leaves(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if inner is None:
        yield name, value
        return
    for key, element in inner:
        yield from _leaves(element, f"{name}.{key}")


def all_facts(folder: Path) -> dict[str, dict[str, Any]]:
    """Facts of each file below a directory, by its path."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): facts(path) for path in files}


def differences(before: dict[str, Any], again: dict[str, Any], now: dict[str, Any]) -> tuple[int, list[str]]:
    """Number of facts that are compared, and the names of those that differ."""
    steady = [name for name in before if name in again and before[name] == again[name]]
    changed = [name for name in steady if name not in now or now[name] != before[name]]
    return len(steady), changed + [name for name in now if name not in before and name not in again]


def report(before: dict[str, Any], again: dict[str, Any], now: dict[str, Any], shown: int) -> int:
    """Print the files that differ; the number of them."""
    compared = equal = 0
    for name in sorted({*before, *now}):
        if name in before and name not in again:
            continue
        if name not in before or name not in now:
            print(f"{name}: only {'before' if name in before else 'now'}")
            continue
        count, changed = differences(before[name], again[name], now[name])
        compared, equal = compared + count, equal + (not changed)
        if changed:
            print(f"{name}: {len(changed)} of {count} facts differ")
            for fact in changed[:shown]:
                print(f"    {fact}: {before[name].get(fact)!r} -> {now[name].get(fact)!r}"[:400])
    print(f"{equal} of {len({*before, *now})} files are equal; {compared:,} facts are compared")
    return len({*before, *now}) - equal


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.versions.equality", description=__doc__)
    parser.add_argument("--base", required=True, help="commit to compare with")
    parser.add_argument("--shown", type=int, default=3, help="differences shown of each file")
    options = parser.parse_args()
    base = commit_of(options.base)
    with tempfile.TemporaryDirectory(prefix="livebode-equality-") as scratch:
        folder = Path(scratch)
        before = installed(archived(base, folder / "base"), folder / "base-venv")
        now = installed(working_tree(folder / "now"), folder / "now-venv")
        found = []
        for name, python in (("before", before), ("again", before), ("after", now)):
            perform(python, folder / "work", commands(python == now))
            os.rename(folder / "work", folder / name)
            found.append(all_facts(folder / name))
        raise SystemExit(1 if report(found[0], found[1], found[2], options.shown) else 0)


if __name__ == "__main__":
    main()
