"""The core alone: what has to work without SciPy, Matplotlib and PyArrow works; the rest names the extra it needs."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.tables import Table, write_parquet
from tests.support.answers import Answer
from tests.support.answers import answers as in_one_process
from tests.support.loop_runs import AXIS, record

CHIRP = "--excitation w --input u --output velocity --lines 20:140:10 --window 400"
OUTPUT_ONLY = ("--output-only", "--output", "y", "--rate", "4000")
ABSENT = ("scipy", "matplotlib", "mpl_toolkits", "PIL", "contourpy", "kiwisolver", "fontTools", "pyarrow", "nanoarrow")


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Answer]:
    folder = tmp_path_factory.mktemp("core")
    log = record(folder / "log.parquet", 1)
    write_parquet(log, Table.from_arrow(pq.read_table(log)))
    (folder / "axis.toml").write_text(AXIS.format(gain=0.2308, delay=0), encoding="utf-8")
    (folder / "tone.wav").write_bytes(
        b"RIFF\x24\0\0\0WAVEfmt \x10\0\0\0\1\0\1\0\x40\x1f\0\0\x80\x3e\0\0\2\0\x10\0data\0\0\0\0"
    )
    foreign = pa.table({"t": np.arange(9.0)})
    pq.write_table(foreign, folder / "foreign.parquet")
    with pa.ipc.new_file(folder / "foreign.arrow", foreign.schema) as file:
        file.write_table(foreign)
    run = str(folder / "run")
    commands: dict[str, list[str]] = {
        "run": ["run", str(folder / "axis.toml"), "--out", run],
        "fit": ["fit", run],
        "margins": ["margins", run],
        "inspect": ["inspect", str(folder / "log.parquet"), "--excitation", "w", "--output", "y", "--rate", "4000"],
        "compare": ["compare", run, run],
        "export": ["export", run, "--to", "csv"],
        "example": ["example", "design"],
        "example-csv": ["example", "archive"],
        "design": ["design", "example/experiment.toml", "--out", str(folder / "design")],
        "demo": ["demo", "--fast", "--seconds", "16", "--out", str(folder / "demo")],
        "report": ["report", run],
        "validate": ["validate", run, "--on", str(folder / "log.parquet")],
        "modal": ["fit", run, "--model", "modal"],
        "mat": ["export", run, "--to", "mat"],
        "wav": ["inspect", str(folder / "tone.wav")],
        "csv": ["run", "example/standstill.csv", *CHIRP.split(), "--out", run + "3"],
        "foreign": ["inspect", str(folder / "foreign.parquet")],
        "arrow": ["inspect", str(folder / "foreign.arrow")],
        "query": ["export", run, "--sql", "SELECT 1"],
        "lake": ["archive", "list", str(folder)],
        "archive": ["archive", "run", "example/archive.toml"],
        "fleet": ["fleet", "run", "--demo"],
        "output-only": ["run", str(folder / "log.parquet"), *OUTPUT_ONLY, "--out", run + "2"],
    }
    return dict(zip(commands, in_one_process(*commands.values(), absent=ABSENT, folder=folder)))


@pytest.mark.parametrize(
    "command",
    ["run", "fit", "margins", "inspect", "compare", "export", "example", "example-csv", "design", "demo", "csv"],
)
def test_the_core_does_its_work_alone(answers: dict[str, Answer], command: str) -> None:
    assert answers[command].code == 0, answers[command].err
    assert "error" not in answers[command].err


def test_a_report_without_its_fonts_says_how_to_get_a_pdf(answers: dict[str, Answer]) -> None:
    assert answers["report"].code == 0
    assert "no PDF: a PDF needs the fonts of Matplotlib; run " in answers["report"].out


@pytest.mark.parametrize(
    ("command", "extra", "sentence"),
    [
        ("validate", "analysis", "a validation needs SciPy, which is not installed; run "),
        ("modal", "analysis", "a fit of poles needs SciPy, which is not installed; run "),
        ("mat", "analysis", "an export for MATLAB needs SciPy, which is not installed; run "),
        ("wav", "analysis", "a WAV file needs SciPy, which is not installed; run "),
        ("output-only", "analysis", "a run from the outputs alone needs SciPy, which is not installed; run "),
        ("foreign", "parquet", "foreign.parquet needs the package pyarrow, which is not installed; run "),
        ("arrow", "parquet", "foreign.arrow needs the package pyarrow, which is not installed; run "),
        ("query", "query", "a query needs PyArrow, which is not installed; run "),
        ("lake", "archive", "the command archive needs PyArrow, which is not installed; run "),
        ("archive", "archive", "the command archive needs PyArrow, which is not installed; run "),
        ("fleet", "fleet", "the command fleet needs PyArrow, which is not installed; run "),
    ],
)
def test_what_needs_an_extra_names_it(answers: dict[str, Answer], command: str, extra: str, sentence: str) -> None:
    assert answers[command].code == 2
    assert sentence in answers[command].err
    assert {"analysis": "scipy"}.get(extra, "pyarrow") in answers[command].err or extra in answers[command].err
    assert "Traceback" not in answers[command].err
