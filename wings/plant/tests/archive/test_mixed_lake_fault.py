"""A lake with runs of outputs alone among others: what needs responses says so, and everything else works."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.support import ringing
from tests.support.archives import RECIPE, cluster_here, write_recording
from tests.support.command import livebode

BAND = """
[signals]
output = "y"
[output_only]
band_hz = [20.0, 40.0]
"""


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lake of an axis with responses and of a spindle of which only the output is recorded."""
    folder = tmp_path_factory.mktemp("mixed")
    for kind in ("milling", "spindles"):
        (folder / kind / f"{kind} 1").mkdir(parents=True)
    write_recording(folder / "milling" / "milling 1" / "log.parquet", 1)
    (output,) = ringing.two_modes(1, 6000)
    columns = {"t": np.arange(len(output)) / ringing.RATE_HZ, "y": output}
    pq.write_table(pa.table(columns), folder / "spindles" / "spindles 1" / "log.parquet")
    with cluster_here() as address:
        for kind, recipe in (("milling", RECIPE), ("spindles", BAND)):
            (folder / f"{kind}-recipe.toml").write_text(recipe)
            archive = folder / f"{kind}.toml"
            archive.write_text(
                f'inputs = ["{kind}/{{machine}}/*.parquet"]\nrecipe = "{kind}-recipe.toml"\nlake = "lake"\n'
                f'[cluster]\naddress = "{address}"\n'
            )
            done = livebode("archive", "run", archive)
            assert done.code == 0, done.err
    return folder / "lake"


def test_what_is_in_quarantine_is_tracked_again_on_request(tmp_path: Path) -> None:
    (tmp_path / "press").mkdir()
    (tmp_path / "press" / "log.csv").write_text("t,u,y\n0,1,1\n0.001,1,1\n")
    (tmp_path / "recipe.toml").write_text(RECIPE)
    with cluster_here() as address:
        (tmp_path / "archive.toml").write_text(
            f'inputs = ["{{machine}}/*.csv"]\nrecipe = "recipe.toml"\nlake = "lake"\n[cluster]\naddress = "{address}"\n'
        )
        tried = [
            json.loads(livebode("archive", "run", tmp_path / "archive.toml", *options, "--json").out)
            for options in ((), (), ("--retry", "older"), ("--retry", "all"))
        ]
    assert [len(one["quarantined"]) for one in tried] == [1, 0, 0, 1]


def test_a_run_without_responses_gives_no_baseline_and_one_sentence_says_why(lake: Path, tmp_path: Path) -> None:
    learned = livebode("archive", "learn", lake, "--each", "--out", tmp_path / "{machine}.json", "--json")
    refused = {one["machine"]: one for one in json.loads(learned.out)["refused"]}
    assert learned.code == 2
    assert refused["spindles 1"]["code"] == "baseline.run-without-responses"
    assert "no response to learn from" in refused["spindles 1"]["message"]
    assert refused["milling 1"]["code"] == "baseline.too-few-windows"  # this one has responses


def test_list_trend_and_report_have_the_machines_of_both_kinds(lake: Path, tmp_path: Path) -> None:
    listed = json.loads(livebode("archive", "list", lake, "--json").out)["machines"]
    assert [(one["machine"], one["runs"]) for one in listed] == [("milling 1", 1), ("spindles 1", 1)]
    for quantity, machine in (("J", "milling 1"), ("mode 1:frequency", "spindles 1")):
        trend = livebode("archive", "trend", lake, quantity)
        assert (trend.code, machine in trend.out) == (0, True), trend.err
    reported = livebode("archive", "trend", lake, "--out", tmp_path / "hall.html")
    assert reported.code == 0, reported.err
    page = (tmp_path / "hall.html").read_text()
    assert "milling 1" in page
    assert "spindles 1" in page
