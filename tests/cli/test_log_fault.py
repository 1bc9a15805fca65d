"""The log: quiet by default, one safe line for each record, and no disk or reader of it ends a run."""

from __future__ import annotations

import json
import logging
import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.cli.log_output import LineFormatter, log_output
from livebode.configuration import Axis
from livebode.core import SourceError
from livebode.dashboard import Dashboard, ServerSettings
from livebode.plugins import named
from livebode.sources.live import SourceSettings, make_source
from tests.support.command import livebode, signals, write_parquet
from tests.support.peers.peer import Feeding, batches, free_port, send_all, until
from tests.support.peers.plain import TcpPeer
from tests.support.runs import small_run
from tests.support.small_axis import ONE_LINE

LINE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z (DEBUG|INFO|WARNING|ERROR) livebode\.[a-z0-9_.]+: .+")
SECRET = "hunter2-and-more"
ROLES = ("--output", "y", "--input", "u", "--excitation", "w", "--json")


def test_a_program_that_asks_for_no_log_sees_none() -> None:
    code = "import livebode.core, logging; logging.getLogger('livebode.runtime.live').error('not shown')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == ""


@settings(max_examples=50, deadline=None)
@given(st.text(), st.text(min_size=1), st.floats(0, 4e9))
def test_a_record_is_one_printable_line_whatever_it_holds(message: str, fact: str, at_s: float) -> None:
    try:
        raise ValueError(fact)
    except ValueError:
        record = logging.LogRecord("livebode.x", logging.INFO, "", 0, "%s %s", (message, fact), sys.exc_info())
    record.created = at_s
    line = LineFormatter().format(record)
    assert len(line.splitlines()) == 1
    assert not re.search("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202e]", line)
    assert LINE.match(line)


def test_the_log_goes_to_a_file_with_options_before_the_command(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", signals(1000))
    own = tmp_path / "own.log"
    options, command = ("--log-level", "debug", "--log-file", own), ("inspect", log, "--json")
    behind = livebode(*command, *options)
    assert behind.code == 2
    assert "--log-level stands before the command: livebode --log-level … inspect …" in behind.err
    done = livebode(*options, *command)
    assert (done.code, done.err) == (0, "")
    lines = own.read_text().splitlines()
    assert all(LINE.fullmatch(line) for line in lines)
    assert lines[0].endswith("livebode inspect begins")
    assert lines[-1].endswith("livebode inspect ends")
    assert logging.getLogger("livebode").level == logging.NOTSET


def test_a_file_alone_has_level_info_and_an_error_with_its_code(tmp_path: Path) -> None:
    own = tmp_path / "own.log"
    done = livebode("--log-file", own, "run", tmp_path / "missing.parquet", *ROLES)
    assert done.code == 2
    (error,) = [line for line in own.read_text().splitlines() if " ERROR " in line]
    assert f" ERROR livebode.cli.run_command: {json.loads(done.err)['error']['code']}: " in error


def test_the_log_goes_to_standard_error_without_a_file(tmp_path: Path) -> None:
    done = livebode("--log-level", "info", "inspect", write_parquet(tmp_path / "log.parquet", signals(1000)))
    assert done.code == 0
    assert done.err
    assert all(LINE.fullmatch(line) for line in done.err.splitlines())


def test_a_level_that_does_not_exist_or_a_file_that_cannot_be_opened_is_refused(tmp_path: Path) -> None:
    assert livebode("--log-level", "loud", "doctor").code == 2
    done = livebode("--log-file", tmp_path / "none" / "own.log", "doctor")
    assert done.code == 2
    assert done.err.count("\n") == 1


def test_a_disk_that_takes_no_log_line_costs_the_line_and_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "own.log"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    log = logging.getLogger("livebode.test")
    with log_output("info", own):
        log.info("first")
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (own.stat().st_size, hard))
            for _ in range(3):
                log.info("second")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        log.info("third")
    assert capsys.readouterr().err.count("cannot be written") == 1
    assert "third" in own.read_text()


def test_a_log_file_is_of_bounded_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebode.cli.log_file.FILE_BYTES_MAX", 10_000)
    log = logging.getLogger("livebode.test")
    with log_output("info", tmp_path / "own.log"):
        for number in range(1000):
            log.info("line %d", number)
    assert sum(os.path.getsize(path) for path in tmp_path.iterdir()) <= 20_000
    assert (tmp_path / "own.log").read_text().endswith("line 999\n")


LOGIN = 'username = "joe-the-user"\npassword_env = "LIVEBODE_TEST_PASSWORD"'
DBC = Path(__file__).parents[2] / "examples/can/odrive.dbc"
SOURCES = {
    "udp": 'url = "udp://127.0.0.1:{port}"',
    "tcp": 'url = "tcp://127.0.0.1:{port}"',
    "mqtt": f'url = "mqtt://127.0.0.1:{{port}}/t"\n{LOGIN}\nclient_id = "c"',
    "mqtts": f'url = "mqtts://127.0.0.1:{{port}}/t"\n{LOGIN}',
    "opc.tcp": f'url = "opc.tcp://127.0.0.1:{{port}}"\nrate_hz = 1000\n{LOGIN}\n[source.nodes]\ny = "ns=2;s=y"',
    "ads": 'url = "ads://127.0.0.1:{port}"\nnet_id = "5.1.2.3.1.1"\nsymbol = "MAIN.r"\nchannels = ["w", "y"]',
    "can": f'url = "can:socketcan/no{{port}}"\ndbc = "{DBC}"\nrate_hz = 1000\nchannels = ["Vel_Estimate"]',
    "hal": 'url = "hal:sampler.7"\nsample_signal = "n"',
    "klipper": 'url = "klipper:/nowhere/{port}"',
    "daqref": 'url = "daqref://none{port}"',
    "daq.nd": 'url = "daq.nd://127.0.0.1:{port}"',
    "serial": 'url = "serial:/nowhere/tty{port}"',
}


def test_every_kind_of_url_is_in_the_test_below() -> None:
    assert SOURCES.keys() == named("sources").keys() - {"stdin"}


def _is_installed(kind: str) -> bool:
    """openDAQ has no package for Python 3.13."""
    return not kind.startswith("daq") or sys.version_info < (3, 13)


@pytest.mark.parametrize("kind", [*filter(_is_installed, SOURCES)])
def test_a_source_that_does_not_answer_is_logged_with_its_address_and_without_a_secret(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, kind: str
) -> None:
    monkeypatch.setenv("LIVEBODE_TEST_PASSWORD", SECRET)
    (tmp_path / "axis.toml").write_text(
        f"[source]\ntimeout_s = 0.2\n{SOURCES[kind].format(port=free_port())}\n{ONE_LINE}"
    )
    axis = Axis.read(tmp_path / "axis.toml")
    with caplog.at_level(logging.DEBUG, "livebode"), pytest.raises(SourceError):
        make_source(axis.source).open()
    assert f"opening {axis.source.url}" in caplog.text
    assert {name for name, _, _ in caplog.record_tuples} == {
        f"livebode.sources.live.{make_source(axis.source).__module__.rpartition('.')[2]}"
    }
    for secret in (SECRET, "joe-the-user"):
        assert secret not in caplog.text + "".join(repr(record.__dict__) for record in caplog.records)


@pytest.mark.parametrize(
    "source",
    [
        f'url = "mqtt://me:{SECRET}@127.0.0.1/t"',
        f'url = "mqtt://me:{SECRET}"',
        f'url = "mqtt://me:{SECRET}%40h/t"',
        f'url = "tcp://h:1/{SECRET}"',
        f'url = "http://h/{SECRET}"',
        f'url = "udp://127.0.0.1:1?password={SECRET}"',
        f'url = "mqtt://h/t"\npassword = "{SECRET}"',
        f'url = "mqtt://h/t"\npassword_env = ["{SECRET}"]',
        f'url = "mqtt://h/t"\nusername = ["{SECRET}"]',
        f'url = "mqtt://h/t"\npassword_env = "{SECRET}"',
        f'url = "mqtt://h/t"\npassword_file = "{SECRET}"',
        f'url = "mqtt://h/t"\nusername = "{SECRET}"\nca_file = "nowhere"',
    ],
)
def test_a_configuration_that_is_refused_is_logged_without_its_secret(tmp_path: Path, source: str) -> None:
    (tmp_path / "axis.toml").write_text(f"[source]\n{source}\n{ONE_LINE}")
    own = tmp_path / "own.log"
    done = livebode("--log-level", "debug", "--log-file", own, "run", tmp_path / "axis.toml")
    assert done.code == 2
    assert " ERROR livebode." in own.read_text()
    assert SECRET not in own.read_text() + done.err + done.out


def test_a_machine_that_comes_goes_and_comes_again_is_logged(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with TcpPeer(tmp_path) as peer, caplog.at_level(logging.DEBUG, "livebode"):

        def script() -> None:
            peer.wait_ready()
            send_all(peer, batches(2))

        with Feeding(script) as feeding, make_source(SourceSettings(**peer.settings)) as source:
            source.open()
            feeding.join()
            peer.interrupt()
            until(lambda: source.health.counts["connected"] == 2, "the second connection")
        address = peer.settings["url"]
    lines = [(record.levelname, record.getMessage()) for record in caplog.records if record.name.endswith(".tcp")]
    assert lines[0] == ("INFO", f"opening {address}")
    assert lines[-1] == ("INFO", f"{address}: reception ended")
    assert lines.count(("INFO", f"connected to {address}")) == 2
    assert ("INFO", f"{address}: 2 channels at 4000 Hz") in lines
    assert [level for level, text in lines if "closed the connection" in text] == ["WARNING", "DEBUG"]


def test_a_record_is_logged_from_its_beginning_over_its_segments_to_its_end(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    columns = signals(4000)
    columns["y"][2000] = float("nan")
    with caplog.at_level(logging.INFO, "livebode"):
        run = small_run(tmp_path, columns, record={"segment_s": 1.0})
    text = [f"{name}: {message}" for name, level, message in caplog.record_tuples if level == logging.INFO]
    begun = text.index(f"livebode.records.segments.store: {run}: the record begins at sample 0")
    ended = text.index(f"livebode.records.segments.store: {run}: the record ends, finished")
    closed = [i for i, line in enumerate(text) if line.startswith("livebode.records.segments.shelf: ")]
    assert begun < closed[0] < closed[-1] < ended
    assert len(closed) >= 4
    (event,) = [line for line in text[begun:ended] if line.startswith("livebode.runtime.run_loop: ")]
    assert "not finite" in event


def test_a_dashboard_is_logged_from_its_start_to_its_stop(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "livebode"), Dashboard(ServerSettings("127.0.0.1", 0)) as dashboard:
        url = dashboard.url
    assert [message for name, _, message in caplog.record_tuples if name == "livebode.dashboard.dashboard"] == [
        f"listening at {url}",
        "stopped",
    ]
