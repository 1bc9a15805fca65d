"""Commands with URLs on a real S3 server: the same results as with paths, and nothing of a temporary file in them."""

import gc
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import livebode as library
from livebode.locations import Url, find, read_bytes, upload, write_whole
from tests.support.command import Result, livebode, signals, write_csv
from tests.support.object_storage import BUCKET, object_storage
from tests.support.peers.peer import until

ROLES = (
    "--excitation",
    "w",
    "--input",
    "u",
    "--output",
    "y",
    "--lines",
    "50,100,200",
    "--window",
    "100",
    "--hop",
    "20",
)
ROOT = f"s3://{BUCKET}"
RUN = f"{ROOT}/runs/monday"


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A directory with a recording and its run, and both in the storage; the run there is of the recording there."""
    folder = tmp_path_factory.mktemp("desk")
    log = write_csv(folder / "log.csv", signals(3000))
    with object_storage():
        write_whole(f"{ROOT}/site/log.csv", log.read_bytes())
        assert livebode("run", log, *ROLES, "--out", folder / "monday").code == 0
        done = livebode("run", f"{ROOT}/site/log.csv", *ROLES, "--out", RUN)
        assert (done.code, done.err) == (0, "")
        assert f"{RUN}/\n" in done.out
        yield folder


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty directory to work in, and one for copies, of which none remains unless a test says so."""
    copies = tmp_path / "copies"
    copies.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(copies))
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    yield tmp_path / "here"
    # The thread that wrote a table may have the last reference for a moment longer than the command, or a ring has it.
    until(lambda: gc.collect() >= 0 and not list(copies.iterdir()), "the removal of the copies")


def test_a_run_there_equals_the_one_here_and_names_only_urls(desk: Path) -> None:
    there = {str(one.url).removeprefix(f"{RUN}/"): read_bytes(one.url) for one in find(RUN)}
    assert there.keys() == {path.name for path in (desk / "monday").iterdir()}
    summary = json.loads(there["run.json"])
    assert summary["configuration"]["source"]["log"] == f"{ROOT}/site/log.csv"
    for name in ("run.json", "events.jsonl"):
        assert b"livebode-" not in there[name]
        assert b"/copies/" not in there[name]
    run = library.Run(RUN)
    np.testing.assert_array_equal(run.responses.value, library.Run(desk / "monday").responses.value)
    del run


def test_a_finished_run_in_segments_is_read_where_no_empty_directory_can_be(desk: Path) -> None:
    assert livebode("run", desk / "log.csv", *ROLES, "--continue", "--out", "segments").code == 0
    upload("segments", Url(f"{ROOT}/runs/segments"))
    there = library.Run(f"{ROOT}/runs/segments")
    np.testing.assert_array_equal(there.responses.value, library.Run(desk / "monday").responses.value)
    assert [event.kind for event in there.events] == [event.kind for event in library.Run("segments").events]
    del there


def same(there: Result, here: Result) -> None:
    assert (there.code, there.err) == (here.code, here.err)
    assert there.out.replace(f"{ROOT}/site/", "").replace(f"{RUN}/", "") == here.out


def test_a_command_on_a_run_prints_the_same(desk: Path) -> None:
    sql = "select count(*), sum(re) from responses"
    same(livebode("export", RUN, "--sql", sql), livebode("export", desk / "monday", "--sql", sql))


def test_inspect_prints_the_same(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = livebode("inspect", f"{ROOT}/site/log.csv", "--excitation", "w")
    monkeypatch.chdir(desk)
    same(there, livebode("inspect", "log.csv", "--excitation", "w"))


def test_several_recordings_and_a_configuration_name_their_urls(desk: Path, here: Path) -> None:
    write_whole(f"{ROOT}/site/other.csv", write_csv(here / "other.csv", signals(seed=1)).read_bytes())
    logs = [f"{ROOT}/site/log.csv", f"{ROOT}/site/other.csv"]
    Path("axis.toml").write_text(
        f'[source]\nlog = {json.dumps(logs)}\n[signals]\nexcitation = "w"\ninput = "u"\noutput = "y"\n'
    )
    assert livebode("run", "axis.toml", "--out", "both").err == ""
    summary = json.loads(Path("both/run.json").read_text())
    assert summary["configuration"]["source"]["log"] == logs
    assert [part["file"] for part in summary["found"]["recordings"]] == logs
    assert desk


@pytest.mark.usefixtures("desk")
def test_a_proposed_configuration_names_the_url() -> None:
    assert livebode("inspect", f"{ROOT}/site/log.csv", "--out", "axis.toml", "--yes").err == ""
    assert f'log = "{ROOT}/site/log.csv"' in Path("axis.toml").read_text()


@pytest.mark.usefixtures("desk")
def test_results_about_a_run_there_are_written_here(here: Path) -> None:
    for command in (("export", RUN, "--to", "csv"), ("report", RUN), ("learn", RUN, "--out", "baseline.json")):
        assert livebode(*command).err == ""
    files = {path.relative_to(here).as_posix() for path in here.rglob("*") if path.is_file()}
    assert files >= {"monday.csv", "monday/report.html", "baseline.json"}
    assert json.loads(Path("baseline.json").read_text())["runs"] == [RUN]


def refused(*arguments: str) -> str:
    done = livebode(*arguments)
    assert (done.code, done.out) == (2, "")
    assert done.err.count("\n") == 1
    return done.err


@pytest.mark.usefixtures("desk")
def test_a_run_is_not_recorded_where_something_is_or_cannot_be() -> None:
    assert "is not replaced" in refused("run", f"{ROOT}/site/log.csv", *ROLES, "--out", RUN)
    assert "nothing at s3://nowhere" in refused("run", f"{ROOT}/site/log.csv", *ROLES, "--out", "s3://nowhere/run")
    assert "in segments" in refused("run", f"{ROOT}/site/log.csv", *ROLES, "--continue", "--out", f"{ROOT}/live")


@pytest.mark.usefixtures("desk")
def test_a_path_is_asked_for_where_a_url_cannot_be_used(here: Path) -> None:
    for arguments in (("report", RUN, "--out", f"{ROOT}/report"), ("run", "a.csv", "--baseline", f"{ROOT}/b.json")):
        assert f"is the URL {ROOT}/" in refused(*arguments)
    assert "copy it to this computer" in refused("run", f"{ROOT}/axis.toml")
    assert not list(here.iterdir())


@pytest.mark.usefixtures("desk")
def test_an_error_names_the_url_and_not_the_copy() -> None:
    write_whole(f"{ROOT}/site/bad.csv", b"t [s],y\n0,1\n0.001,x\n0.002,1\n0.003,1\n")
    with pytest.raises(library.RecordingError, match=f"line 3 of {ROOT}/site/bad.csv"):
        list(library.open_log(f"{ROOT}/site/bad.csv").blocks(["y"]))
    assert f"{ROOT}/site is not a run" in refused("fit", f"{ROOT}/site")
    assert f"'{ROOT}/site/bad.csv' is a file" in refused("fit", f"{ROOT}/site/bad.csv")
    failed = json.loads(livebode("run", f"{ROOT}/none.csv", "--output", "y", "--json").err)
    assert failed["error"]["code"] == "location.not-found"
