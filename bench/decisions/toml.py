"""tomli-w compared with the former writers of TOML: `python -m bench.decisions.toml` (docs/decisions).

The former are two: of the settings in a report, and of the axis.toml of a design.
"""

from __future__ import annotations

import json
import random
import time
import tomllib
from collections.abc import Callable, Mapping
from typing import Any

import tomli_w

from bench.decisions.former import code_lines, module, source

REPORT, DESIGN = "src/livebode/session/reporting/wording.py", "src/livebode/design/axis_file.py"
TABLES, SEED = 2000, 20
_LETTERS = ["a", "Z", "9", " ", '"', "'", "\\", "\n", "\t", "\x00", "\x7f", "é", "🌊", ".", "#", "="]


def text(chance: random.Random) -> str:
    return "".join(chance.choices(_LETTERS, k=chance.randint(1, 8)))


def value(chance: random.Random) -> Any:
    kinds: list[Callable[[], Any]] = [
        lambda: text(chance), lambda: chance.choice([True, False]), lambda: chance.randint(-(2**53), 2**53),
        lambda: chance.choice([chance.gauss(0, 1), 1e300, 1e-9, float("inf"), -0.0]),
        lambda: [text(chance) for _ in range(3)],
    ]  # fmt: skip
    return chance.choice(kinds)()


def table(chance: random.Random, depth: int = 0) -> dict[str, Any]:
    count = chance.randint(0, 4)
    return {text(chance): table(chance, depth + 1) if depth < 3 and chance.random() < 0.4 else value(chance)
            for _ in range(count)}  # fmt: skip


def reads_back(write: Callable[[Mapping[str, Any]], str], of: dict[str, Any]) -> bool:
    try:
        return tomllib.loads(write(of)) == of
    except ValueError:
        return False


def main() -> None:
    chance = random.Random(SEED)
    tables = [table(chance) for _ in range(TABLES)]
    report, pairs = module(REPORT).to_toml, module(DESIGN)._pairs
    writers = {"tomli-w": tomli_w.dumps, "report's": report, "design's": lambda of: f"[x]\n{pairs(of['x'])}"}
    flat = [{"x": {k: v for k, v in one.items() if not isinstance(v, dict)}} for one in tables]
    print(f"{TABLES} random tables: read back as written, with nested tables / with one table; time for nested")
    for name, write in writers.items():
        nested = "-" if name == "design's" else sum(reads_back(write, one) for one in tables)
        began = time.perf_counter()
        for one in tables if nested != "-" else flat:
            write(one)
        took_us = 1e6 * (time.perf_counter() - began) / TABLES
        print(f"  {name:9} {nested:>5} / {sum(reads_back(write, one) for one in flat):5}   {took_us:6.1f} µs a table")
    texts = source(REPORT), source(DESIGN)
    own = texts[0][texts[0].index("def to_toml") :] + texts[1][texts[1].index("def _pairs") :]
    print(f"lines of code of the former writers: {code_lines(own)}")
    many = {"motion": {"positions_m": [0.1 * i for i in range(12)]}}
    print(f"lines of a list of 12 numbers: tomli-w {tomli_w.dumps(many).count(chr(10))}, report's "
          f"{report(many).count(chr(10)) + 1}; {json.dumps(many['motion']['positions_m'])[:20]}…")  # fmt: skip


if __name__ == "__main__":
    main()
