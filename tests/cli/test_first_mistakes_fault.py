"""What somebody does wrong on the first day: each mistake is one sentence that names the value and what to do."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

import livebode as package
from livebode.configuration import read_serve_section
from livebode.core.optional_packages import _clone, _packages
from livebode.records import RunRecord
from tests.support.command import livebode, signals, write_csv, write_parquet
from tests.support.terminals import on_terminal

BYTES = {
    "picture.csv": b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
    "photo.mat": b"\xff\xd8\xff\xe0\0\x10JFIF",
    "manual.txt": b"%PDF-1.7\n",
    "old.xls": b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500),
    "log.csv.gz": b"\x1f\x8b\x08\0",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("first")
    for name, content in BYTES.items():
        (folder / name).write_bytes(content)
    with zipfile.ZipFile(folder / "book.xlsx", "w") as book:
        book.writestr("[Content_Types].xml", "<Types/>")
        book.writestr("xl/workbook.xml", "<workbook/>")
    (folder / "empty.csv").touch()
    (folder / "header.csv").write_text("t,w,u,y\n")
    (folder / "text.txt").write_text("Dear reader,\nthis is a letter.\n")
    (folder / "directory").mkdir()
    (folder / "key.toml").write_text('[source]\nlog = "log.csv"\n[signals]\nexcitaton = "w"\noutput = "y"\n')
    (folder / "section.toml").write_text('[source]\nlog = "log.csv"\n[tracking]\nlines = "20"\n')
    (folder / "broken.toml").write_text("[source\n")
    given = signals()
    write_csv(folder / "log.csv", given)
    speeds = {"speed1": given["y"], "speed2": -given["y"]}
    write_csv(folder / "axes.csv", {name: given[name] for name in "twu"} | speeds)
    rng = np.random.default_rng(3)
    write_csv(folder / "noise.csv", {"t": given["t"]} | {name: rng.standard_normal(2000) for name in "ab"})
    roles = ("--excitation", "w", "--input", "u", "--output", "y")
    assert livebode("run", folder / "log.csv", *roles, "--out", folder / "runs/monday").code == 0
    return folder


MISTAKES = [
    ("run nofile.csv", "there is no file nofile.csv"),
    ("run directory", "directory is a directory"),
    ("run log.csv --input u", "the output channel is not named"),
    (
        "run axes.csv",
        "the output could be 'speed1' or 'speed2'; name them by --excitation, --input and --output; `livebode",
    ),
    (
        "run noise.csv",
        "the input is not recognised among t, a, b; name them by --excitation, --input and --output; `livebode inspect",
    ),
    ("run log.csv --output yy", "did you mean 'y'?"),
    ("run log.csv --excitation w --input u --output y --lines 20-140 --window 100", "cannot be read"),
    ("run log.csv --excitation w --input u --output y --lines 55 --window 100", "the nearest lines are 50 and 60 Hz"),
    ("run log.csv --excitation w --input u --output y --lines 900 --window 100", "Nyquist"),
    ("run log.csv --excitation w --input u --output y --window 0.1", "neither a whole number"),
    ("run log.csv --excitation w --input u --output y --window 9999", "less than the window"),
    ("run log.csv --excitation w --input u --output y --schedule=", "signals.schedule = '' is not usable"),
    ("inspect log.csv --excitation w --skip-periods=-1", "skip_periods=-1 is less than 0"),
    (
        "run log.csv --excitation w --input u --output y --window 0",
        "lines.window = 0 is not usable: input should be greater than or equal to 3",
    ),
    (
        "run log.csv --excitation w --input u --output y --window=-1",
        "lines.window = -1 is not usable: input should be greater than or equal to 3",
    ),
    ("run log.csv --excitation w --input u --output y --rate 500", "correct rate_hz"),
    ("run log.csv --excitation w --input u --output y --from 99", "choose other limits"),
    ("run log.csv --excitation w --input u --output y --estimator jont", "'joint'"),
    ("run log.csv --excitation w --input u --output y --out runs/monday", "replace it with force"),
    ("run log.csv --excitation w --input u --output y --out log.csv/run", "could not be written"),
    ("run picture.csv --output y", "is not a recording, but a picture (PNG)"),
    ("inspect photo.mat", "is not a recording, but a picture (JPEG)"),
    ("inspect manual.txt", "a PDF document"),
    ("inspect old.xls", "an Excel workbook (.xls) or another Office document; save its table as CSV"),
    ("inspect book.xlsx", "an Excel workbook (.xlsx) or another Office document; save its table as CSV"),
    ("inspect log.csv.gz", "compressed (gzip); unpack it first"),
    ("inspect empty.csv", "is empty"),
    ("inspect header.csv", "no row of numbers"),
    ("inspect text.txt", "no row of numbers"),
    ("inspect directory", "is a directory"),
    ("run key.toml", "did you mean 'excitation'?"),
    ("run section.toml", "[lines] is a section of its own, with the settings frequencies, window\n"),
    ("run broken.toml", "is not TOML"),
    ("fit runs/nope", "there is no directory 'runs/nope'; Runs in runs: monday"),
    ("fit runs/mondy", "did you mean 'monday'?"),
    ("fit log.csv", "'log.csv' is a file, not the directory of a run"),
    (
        "inspect ads://192.168.0.5",
        "An address has no keys: write them under [source] of axis.toml, with the channels under [signals] "
        "(docs/how-to/live.md), and check the file by `livebode doctor axis.toml`",
    ),
    ("inspect mqtt://user:secret@broker/axis --out new.toml --yes", "set source.username and source.password_env"),
    ("view nowhere/run", "there is no directory 'nowhere/run'"),
    ("view runs/mondy", "did you mean 'monday'?"),
    ("report directory", "has no run.json"),
    ("compare runs/monday runs/nope", "there is no directory 'runs/nope'"),
    ("learn runs/nope --out healthy.json", "there is no directory"),
    ("validate runs/monday --on nofile.csv", "there is no file nofile.csv"),
    ("export runs/monday --to xlsx", "choose csv, mat, netcdf or uff"),
    (
        "run log.csv --excitation w --input u --output y --baseline none.json --force",
        "there is no baseline '{folder}/none.json'; learn one from runs",
    ),
    ("run log.csv key.toml", "a configuration cannot be combined"),
    ("design key.toml", "there is neither [belt] nor [measured]"),
]


@pytest.mark.parametrize(("command", "sentence"), MISTAKES, ids=[command for command, _ in MISTAKES])
def test_a_first_mistake_is_one_sentence(
    command: str, sentence: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    result = livebode(*command.split())
    assert result.code == 2
    assert sentence.replace("{folder}", str(folder)) in result.err
    assert result.err.count("\n") == 1, "one sentence"


def test_decimal_commas_and_semicolons_are_read(folder: Path) -> None:
    text = (folder / "log.csv").read_text().replace(",", ";").replace(".", ",")
    (folder / "german.csv").write_text(text)
    result = livebode("inspect", folder / "german.csv", "--excitation", "w")
    assert (result.code, "repeats every 20 samples" in result.out) == (0, True)


def test_first_mistakes_in_python_are_sentences_too(folder: Path) -> None:
    block = next(package.open_log(folder / "log.csv").blocks(["w", "y"]))
    with pytest.raises(
        package.UsageError, match=r"a Block with the channels w, y; give the samples of one: block\['w'\]"
    ):
        package.recognise(block, "w")
    with pytest.raises(package.UsageError, match="rate_hz='1000' is not a positive number"):
        package.recognise(block["w"], "1000")
    with pytest.raises(package.UsageError, match=r"the lines \[20, 40\] are not text"):
        package.Lines.parse([20, 40], 1000, 100)
    with pytest.raises(package.UsageError, match="lines='20:40:20' are not Lines"):
        package.Settings(lines="20:40:20", output="y", input="u", excitation="w")
    with pytest.raises(package.RecordError, match="is a file, not the directory of a run"):
        package.Run(str(folder / "log.csv"))
    assert RunRecord.open(str(folder / "runs/monday")).lines == package.Run(folder / "runs/monday").lines


def test_view_takes_a_file_that_has_only_the_section_serve(folder: Path) -> None:
    (folder / "serve.toml").write_text('[serve]\nport = 9000\ntoken_file = "token"\n')
    found = read_serve_section(folder / "serve.toml")
    assert (found.port, found.token_file) == (9000, folder / "token")
    (folder / "wrong.toml").write_text("[serve]\nprot = 9000\n")
    with pytest.raises(package.ConfigError, match="did you mean 'port'"):
        read_serve_section(folder / "wrong.toml")


def test_an_extra_is_installed_from_the_clone_while_it_is_there_and_by_its_packages_after(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").touch()
    url = tmp_path.as_uri()
    assert _clone(f'{{"url": "{url}", "dir_info": {{"editable": true}}}}') == (tmp_path, True)
    assert _clone(f'{{"url": "{url}", "dir_info": {{}}}}') == (tmp_path, False)
    assert _clone(f'{{"url": "{url}/gone", "dir_info": {{}}}}') == (None, False)
    assert _clone('{"url": "https://example.org/x.whl", "archive_info": {}}') == (None, False)
    assert _clone(None) == (None, False)
    requires = ["numpy>=2.0", 'reportlab>=4.2; extra == "pdf"', 'h5py>=3.11; extra == "hdf5"']
    assert _packages(requires, ("pdf",)) == ["reportlab>=4.2"]


def test_no_name_is_cut_in_a_narrow_terminal(folder: Path) -> None:
    long = "MAIN.fbAxis.stStatus.fActualVelocityOfTheMotor"
    given = signals(400)
    write_parquet(folder / "long.parquet", {"t": given["t"], f"{long} [rad/s]": given["y"]})
    text = "".join(
        on_terminal(*words, columns=40)[1]
        for words in (("inspect", folder / "long.parquet"), ("doctor", "--runs", folder))
    )
    assert long in text
    assert "…" not in text
    for name in ("instruction set", "not applicable", "UDP receive buffer"):
        assert name in text
