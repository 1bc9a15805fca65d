"""A short recording is read once, a long one as often as somebody asks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from livebode import LivebodeError, open_log
from livebode.sources import held_chunks


@pytest.fixture
def path(tmp_path: Path) -> Path:
    columns = np.random.default_rng(1).standard_normal((3, 500))
    np.savetxt(tmp_path / "log.csv", columns.T, delimiter=",", header="u,y,w", comments="")
    return tmp_path / "log.csv"


def samples(log: object, *names: str) -> np.ndarray:
    return np.concatenate([block.data for block in log.blocks(names)], axis=1)  # type: ignore[attr-defined]


def test_what_was_read_is_not_read_again(path: Path) -> None:
    log = open_log(path, rate_hz=1000)
    whole = samples(log, "u", "y", "w")
    path.unlink()
    assert np.array_equal(samples(log.part(100, 200), "w", "u"), whole[[2, 0], 100:200])
    assert np.array_equal(log["y"], whole[1])


def test_what_was_not_read_to_the_end_is_read_again(path: Path) -> None:
    log = open_log(path, rate_hz=1000)
    next(iter(log.blocks(["u"], 10)))
    samples(log, "u")
    assert samples(log, "y", "u").shape == (2, 500)
    path.unlink()
    with pytest.raises(LivebodeError):
        samples(log, "w")


def test_a_long_recording_is_not_held(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(held_chunks, "VALUES_MAX", 999)
    log = open_log(path, rate_hz=1000)
    samples(log, "u", "y")
    path.unlink()
    with pytest.raises(LivebodeError):
        samples(log, "u")
