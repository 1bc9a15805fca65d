"""A run on a recording of any format gives the responses of the same samples in Parquet, bit for bit."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.support.command import livebode, signals, write_parquet
from tests.support.recordings import DBC, write


def responses(log: Path, out: Path, channels: dict[str, str], *options: object) -> dict[str, list[object]]:
    roles = [word for role, name in channels.items() for word in (f"--{role}", name)]
    result = livebode("run", log, *roles, "--lines", "50,100,200", "--window", 100, "--out", out, *options)
    assert result.code == 0, result.err
    return pq.read_table(out / "responses.parquet").to_pydict()


@pytest.mark.parametrize(("module", "prefix"), [("ulog", "log.")])
def test_responses_equal_those_of_parquet(tmp_path, module, prefix):
    roles = {"excitation": "w", "input": "u", "output": "y"}
    expected = responses(write_parquet(tmp_path / "a.parquet", signals()), tmp_path / "expected", roles)
    log = write(module, tmp_path, signals())
    options = ["--dbc", tmp_path / DBC] if (tmp_path / DBC).exists() else []
    found = responses(log, tmp_path / "found", {role: prefix + name for role, name in roles.items()}, *options)
    assert repr(found) == repr(expected)  # NaN equals NaN, and every digit counts
    listed = livebode("inspect", log, *options).out
    assert all(f"{prefix}{name} " in listed for name in "wuy")
