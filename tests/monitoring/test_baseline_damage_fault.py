"""A file of a baseline is damaged: it is refused with a sentence.

`make damage` does it many more times.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from livebode import BaselineError
from livebode.monitoring import Baseline
from tests.support.baselines import with_checksum
from tests.support.damaged_bytes import one_sentence
from tests.support.file_damage import KINDS, damaged
from tests.support.stateful_cases import baseline
from tests.support.strokes import learned_torque

FAULTS = int(os.environ.get("LIVEBODE_DAMAGE_FLIPS", "100"))


@pytest.mark.parametrize("by_model", [True, False])
def test_each_damage_of_a_baseline_is_named(tmp_path: Path, by_model: bool) -> None:
    rng, path, codes = np.random.default_rng(4), tmp_path / "healthy.json", Counter[tuple[str, str]]()
    replace(baseline(by_model=by_model), torque=learned_torque()).save(path)
    Baseline.load(path)
    whole = path.read_bytes()
    for number in range(FAULTS):
        kind = list(KINDS)[number % len(KINDS)]
        path.write_bytes(damaged(whole, rng, kind))
        with pytest.raises(BaselineError) as caught:
            Baseline.load(path)
        one_sentence(caught.value)
        codes[kind, caught.value.code] += 1
    for (kind, code), count in sorted(codes.items()):
        print(f"baseline {kind:6} {code:24} {count:5} named")


def test_a_baseline_without_one_of_its_keys_is_refused_with_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "healthy.json"
    replace(baseline(by_model=True), torque=learned_torque()).save(path)
    whole = json.loads(path.read_text("utf-8"))
    del whole["crc32"]
    for place in places(whole):
        if place[-1] in ("id", "ways", "unit", "torque", "replaces", "livebode"):
            continue  # for a reader: the order of the axis; and what not every baseline has
        data = json.loads(json.dumps(whole))
        table = data
        for step in place[:-1]:
            table = table[step]
        del table[place[-1]]
        path.write_bytes(with_checksum(data))
        with pytest.raises(BaselineError) as caught:
            Baseline.load(path)
        one_sentence(caught.value)


def places(value: object) -> list[list[str | int]]:
    """Every key of every table."""
    found: list[list[str | int]] = []
    if isinstance(value, dict):
        for name, inner in value.items():
            found += [[name], *([name, *rest] for rest in places(inner))]
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            found += [[number, *rest] for rest in places(inner) if rest]
    return found
