"""A run read back is what was written, and a damaged one is refused with a sentence."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Block, DamageWarning, Lines, RecordError
from livebode.estimation import Settings, Tracker
from livebode.records import RunRecord
from livebode.records.summary_file import to_document
from tests.support.command import RATE_HZ, livebode, signals, write_parquet
from tests.support.errors import refused
from tests.support.responses import as_recorded


@pytest.fixture
def run(tmp_path: Path) -> Path:
    columns = signals()
    columns["y"][700] = np.nan
    log, out = write_parquet(tmp_path / "log.parquet", columns), tmp_path / "run"
    given = ("--excitation", "w", "--input", "u", "--output", "y", "--schedule", "t", "--lines", "50,100,200")
    assert livebode("run", log, *given, "--window", 100, "--hop", 1, "--out", out).code == 0
    return out


@pytest.mark.parametrize("rows", [1, 7, 1 << 16])
def test_responses_come_back_exactly(run: Path, rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebode.records.run._ROWS", rows)
    columns = signals()
    columns["y"][700] = np.nan
    lines = Lines.parse("50,100,200", RATE_HZ, 100)
    block = Block(np.array([columns[n] for n in "wuyt"]), tuple("wuyt"), RATE_HZ)
    settings = Settings(lines=lines, output="y", input="u", excitation="w", schedule="t", hop=1)
    expected = as_recorded(Tracker(settings).process(block))
    read = RunRecord.open(run)
    assert read.lines == lines
    found = read.responses()
    for field in fields(found):
        a, b = getattr(found, field.name), getattr(expected, field.name)
        assert np.array_equal(a, b, equal_nan=a.dtype.kind in "fc") if isinstance(a, np.ndarray) else a == b, field.name
    assert [event.kind for event in read.events()] == ["noise-from-detection-lines", "non-finite"]


def test_an_incomplete_run_is_read_with_a_warning_or_refused(run: Path, tmp_path: Path) -> None:
    with refused(RecordError, "not-a-run", path=str(tmp_path)):
        RunRecord.open(tmp_path)
    table = run / "responses.parquet"
    whole = table.read_bytes()
    table.write_bytes(whole[: len(whole) // 2])
    said = r"responses\.parquet is damaged: it has \d+ bytes, but the manifest states \d+; 6000 rows of responses"
    with pytest.warns(DamageWarning, match=said):
        assert sum(map(len, RunRecord.open(run).batches())) == 0
    with pytest.warns(DamageWarning, match=said), refused(RecordError, "damaged", path=str(table), table="responses"):
        RunRecord.open(run).responses()
    (run / "run.json").write_text("{")
    with pytest.warns(DamageWarning, match=r"run\.json' is damaged: it has no checksum; its copy"):
        assert RunRecord.open(run).events()
    (run / "run-copy.json").write_text("[]")
    with refused(RecordError, "damaged", path=str(run / "run.json"), reason="it has no checksum"):
        RunRecord.open(run)
    (run / "run-copy.json").unlink()
    (run / "run.json").write_bytes(to_document({}))
    with refused(RecordError, "unexpected-content", path=str(run / "run.json"), reason="found: Field required"):
        RunRecord.open(run)
    (run / "run.json").write_bytes(to_document({"format": "another", "found": {}}))
    with refused(RecordError, "not-a-run", path=str(run)):
        RunRecord.open(run)
