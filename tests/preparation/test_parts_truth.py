"""A part of a recording: its samples keep numbers and times, and its responses are those of the whole recording."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from livebode.configuration import Axis
from livebode.core import ConfigError
from livebode.records import RunRecord
from livebode.runtime import Destination, run
from livebode.sources import open_log
from livebode.sources.live import make_source
from tests.support.command import RATE_HZ, WINDOW, livebode, signals, write_csv, write_parquet
from tests.support.disturbed import recorded
from tests.support.errors import refused

BEGINS = 230  # sample at which the excitation begins, 10 s in the time of the recording
ROLES = ("--excitation", "w", "--input", "u", "--output", "y")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Silence, then 20 periods."""
    running = signals(20 * WINDOW)
    rng = np.random.default_rng(1)
    silent = {name: (name != "w") * 0.01 * rng.standard_normal(BEGINS) for name in "wuy"}
    columns = {name: np.concatenate([silent[name], running[name]]) for name in "wuy"}
    time = {"t": 10 + np.arange(BEGINS + 20 * WINDOW) / RATE_HZ}
    return write_parquet(tmp_path_factory.mktemp("part") / "log.parquet", time | columns)


ROLES_OF_RUN = {"excitation": "w", "input": "u", "output": "y"}


def ran(log: Path, out: Path, roles: dict[str, str] = ROLES_OF_RUN, **part: object) -> RunRecord:
    """Without pictures, which take most of the time."""
    lines = {"frequencies": "50,100,200", "window": WINDOW}
    tracking = {"all_periods": not part, "accept_roles": True, "hop": 5}
    axis = Axis.of({"source": {"log": log} | part, "signals": roles, "lines": lines, "tracking": tracking}, "the test")
    run(axis, Destination(out, lambda *_: None))
    return RunRecord.open(out)


@pytest.fixture(scope="module")
def whole(log: Path, tmp_path_factory: pytest.TempPathFactory) -> RunRecord:
    return ran(log, tmp_path_factory.mktemp("whole") / "run")


@pytest.mark.parametrize(
    ("keys", "part"),
    [
        ({"from": 10.5, "to": "11.2 s"}, [500, 1200]),
        ({"from": "500 samples"}, [500, BEGINS + 2000]),
        ({"from": "3 periods", "to": "12 periods"}, [BEGINS + 300, BEGINS + 1200]),
        ({"skip_periods": 2}, [BEGINS + 200, BEGINS + 2000]),
        ({"from": 10.4, "skip_periods": 1, "to": "12 periods"}, [500, 1600]),
    ],
)
def test_responses_of_a_part_are_those_of_the_whole_recording(
    log: Path, whole: RunRecord, tmp_path: Path, keys: dict[str, object], part: list[int]
) -> None:
    chosen = ran(log, tmp_path / "part", **keys)
    assert [chosen.found["part"][key] for key in ("first", "stop")] == part
    assert "part" not in whole.found
    of_part = chosen.responses()
    of_part = of_part[np.flatnonzero(of_part.valid.all(axis=1))]
    assert [of_part.first[0], of_part.sample[-1]] == [-(-part[0] // 5) * 5, part[1] // 5 * 5 - 1]  # hops of 5
    same = whole.responses()[np.flatnonzero(np.isin(whole.responses().sample, of_part.sample))]
    assert np.array_equal(same.time_s, of_part.time_s)
    assert np.allclose(same.value, of_part.value, rtol=1e-12, atol=0)


def test_a_part_in_a_file_is_read_and_recorded_by_the_same_keys(log: Path, tmp_path: Path) -> None:
    file = tmp_path / "axis.toml"
    source = (
        f"[source]\nlog = '{log}'\nfrom = 10.5\nto = '1200 samples'\nskip_periods = 1\n[lines]\nwindow = {WINDOW}\n"
    )
    file.write_text(source + "[signals]\nexcitation = 'w'\ninput = 'u'\noutput = 'y'\n", encoding="utf-8")
    done = livebode("run", file, "--to", "11", "--out", tmp_path / "run")
    assert "part of the recording: from sample 600 to sample 999" in done.out
    record = RunRecord.open(tmp_path / "run")
    assert record.found["part"] == {"first": 600, "stop": 1000}
    recorded = record.summary["configuration"]["source"]
    assert [recorded[key] for key in ("from", "to", "skip_periods")] == [10.5, "11", 1]


def test_inspect_describes_the_part_in_the_numbers_of_the_recording(log: Path) -> None:
    done = livebode("inspect", log, "--excitation", "w", "--output", "y", "--from", "10.5", "--to", "11.2")
    assert "part: samples 500 to 1199 of the recording (10.5 … 11.2 s)" in done.out
    assert "35 periods from sample 500 on" in done.out
    assert livebode("inspect", log, "--from", "3 periods").err.endswith("(option --excitation)\n")


def test_a_run_takes_computed_channels_and_aliases(log: Path, whole: RunRecord, tmp_path: Path) -> None:
    roles = {"excitation": "w + 0*u", "input": "-u", "output": "-(y + y)/2"}
    inverted = ran(log, tmp_path / "computed", roles)
    same = np.isin(inverted.responses().sample, whole.responses().sample)
    assert same.all()
    assert np.allclose(inverted.responses().value, whole.responses().value, rtol=1e-12, atol=0, equal_nan=True)
    table = pq.read_table(log)
    headed = write_csv(
        tmp_path / "headed.csv", {"t": table["t"], "w": table["w"], "u [N m]": table["u"], "y [m]": table["y"]}
    )
    by_alias = ran(headed, tmp_path / "alias", roles | {"input": "u [N m]", "output": "diff(y)"})
    assert by_alias.found["unit"] == "m/s/(N m)"
    assert by_alias.found["kinds"]["output"] == "velocity"


def test_inspect_names_the_stretches_that_a_run_takes(tmp_path: Path) -> None:
    columns = recorded(40, spikes=(3,), pauses=(20, 21), settles=5.0)
    rng = np.random.default_rng(1)
    silence = {name: (name != "w") * 0.05 * rng.standard_normal((2, 530)) for name in columns}
    whole = {name: np.concatenate([silence[name][0], x, silence[name][1]]) for name, x in columns.items()}
    log = write_parquet(tmp_path / "log.parquet", whole)
    arguments = ("inspect", log, "--rate", 4000, "--excitation", "w", "--output", "y")
    found = json.loads(livebode(*arguments, "--json").out)["excitation"]
    assert [stretch["kind"] for stretch in found["stretches"]] == [
        "silence", "transient", "periodic", "outlying", "periodic", "outlying", "periodic", "silence",
    ]  # fmt: skip
    assert [stretch["taken"] for stretch in found["stretches"]] == [False, False, True, False, True, False, True, False]
    edges = [stretch["first"] for stretch in found["stretches"]] + [found["stretches"][-1]["stop"]]
    assert [stretch["stop"] for stretch in found["stretches"]] == edges[1:]
    assert [edges[i] for i in (0, 1, 3, 4, 7, 8)] == [0, 530, 530 + 6 * 200, 530 + 7 * 200, 530 + 40 * 400, 17060]
    table = livebode(*arguments).out
    assert "outlying     1730 … 1929  0.4325 … 0.4825        6  excludes it" in table


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--from", "100"), "has no samples; the recording is between 10 s and 12.23 s"),
        (("--from", "11", "--to", "10.5"), "from sample 1000 to 500 has no samples"),
        (("--from", "soon"), "'soon' is neither seconds, a whole number of samples, nor periods"),
        (("--to", "1.5 samples"), "'1.5 samples' is neither"),
        (("--to", "-2 periods"), "'-2 periods' is neither"),
    ],
)
def test_a_part_that_is_not_possible_is_refused_by_one_sentence(
    log: Path, tmp_path: Path, options: tuple[object, ...], words: str
) -> None:
    done = livebode("run", log, *ROLES, *options, "--out", tmp_path / "run")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert words in done.err


@pytest.mark.parametrize("source", [{"url": "udp://127.0.0.1:5000"}, {"log": Path("grows.csv"), "follow": True}])
def test_a_part_of_a_live_source_is_refused(source: dict[str, object]) -> None:
    with refused(ConfigError, "key-unused", key="source.from"):
        make_source(Axis.of({"source": source | {"from": 2.5}, "signals": {"output": "y"}}, "the test").source)


def test_a_part_counts_its_samples_around_gaps(tmp_path: Path) -> None:
    numbers = np.array([0, 1, 2, 5, 6, 7, 8, 12, 13, 14, 15, 16, 17, 18, 19, 20])
    path = write_parquet(tmp_path / "gaps.parquet", {"t": numbers / 1000, "x": numbers.astype(float)})
    log = open_log(path, rate_hz=1000)
    assert [block.start for block in log.blocks()] == [0, 5, 12]
    for first in range(22):
        for stop in range(first, 23):
            part = log.part(first, stop)
            inside = numbers[(numbers >= first) & (numbers < stop)]
            assert part.samples == inside.size
            read = [(block.start, *block["x"]) for block in part.blocks()]
            assert [start for start, *_ in read] == [x for x, *_ in (samples for _, *samples in read)]
            assert np.array_equal(np.concatenate([[], *(samples for _, *samples in read)]), inside)
