"""`livebode doctor`: what is right is ok, what was made wrong is named, with the value and a remedy."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tomllib
from contextlib import closing
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.core import UsageError, install_command
from livebode.doctor import Subject
from livebode.doctor.computer import check_disk, judged_buffer
from livebode.doctor.installation import check_extras, judged_extras
from livebode.kernel import instruction_sets
from tests.support.command import livebode, signals, write_parquet
from tests.support.errors import refused
from tests.support.peers.peer import free_port
from tests.support.runs import small_run
from tests.support.small_axis import ONE_LINE_DIRECT

ROOT = Path(__file__).parents[2]
FULL_DISK = """
import contextlib, pathlib, sys
from livebode.doctor.computer import check_disk
place = pathlib.Path(sys.argv[1])
for size in (0, 1 << 16, 1):
    with contextlib.suppress(OSError), (place / "other").open("ab", buffering=0) as other:
        while size:
            other.write(bytes(size))
    found = check_disk(place)
    print(found.verdict, found.message)
"""


def doctor(*arguments: object) -> tuple[int, dict[str, dict[str, Any]]]:
    """Exit code, and the checks by name."""
    done = livebode("doctor", "--json", *arguments)
    return done.code, {check["name"]: check for check in json.loads(done.out)["checks"]}


def axis(folder: Path, source: str, rest: str = ONE_LINE_DIRECT) -> Path:
    path = folder / "axis.toml"
    path.write_text(f"[source]\n{source}\n{rest}")
    return path


def test_without_a_configuration_the_computer_is_examined(tmp_path: Path) -> None:
    code, checks = doctor("--runs", tmp_path / "runs")
    assert code == (2 if any(check["verdict"] == "failed" for check in checks.values()) else 0)
    for name in ("configuration", "run", "source"):
        assert checks[name]["verdict"] == "not applicable"
    used = checks["instruction set"]
    assert used["facts"]["available"] == list(instruction_sets())
    assert used["facts"]["used"] in used["message"]
    disk = os.statvfs(tmp_path)
    assert checks["disk"]["facts"]["path"] == str(tmp_path)
    assert 0 < checks["disk"]["facts"]["free_bytes"] <= disk.f_blocks * disk.f_frsize
    assert not list(tmp_path.iterdir())


def test_the_table_on_a_terminal_names_each_check_its_verdict_and_a_remedy(tmp_path: Path) -> None:
    done = livebode("doctor", axis(tmp_path, 'log = "missing.parquet"'))
    assert done.code == 2
    lines = [re.split(r"  +", line.strip()) for line in done.out.splitlines()]
    assert ["source", "failed", f"there is no recording {tmp_path / 'missing.parquet'}"] in lines
    assert ["→ check source.log"] in lines


def test_extras_are_those_of_the_package_and_a_version_that_does_not_suffice_is_named() -> None:
    own = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    facts = check_extras().facts
    assert sorted(extra for names in facts.values() for extra in names) == sorted(set(own) - {"all"})
    elsewhere = {"kubernetes", "slurm", "ssh"}  # needed only where such a cluster is there
    assert own["all"] == [f"livebode[{','.join(sorted(set(own) - {'all'} - elsewhere))}]"]
    found = judged_extras({"mqtt": ["paho-mqtt 1.6 is installed, >=2.1 is required"], "pdf": ["typst is missing"]})
    assert found.verdict == "warning"
    assert found.facts == {"present": [], "missing": ["pdf"], "unsuitable": ["mqtt"]}
    assert found.remedy == f"run {install_command('mqtt')}"


def test_an_unknown_instruction_set_in_the_environment_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIVEBODE_INSTRUCTION_SET", "mmx")
    code, checks = doctor()
    assert code == 2
    assert "'mmx'" in checks["instruction set"]["message"]
    monkeypatch.setenv("LIVEBODE_INSTRUCTION_SET", "baseline")
    narrow = doctor()[1]["instruction set"]
    assert narrow["verdict"] == ("ok" if len(instruction_sets()) == 1 else "warning")


def test_a_port_of_the_dashboard_that_is_taken_fails_where_the_configuration_serves(tmp_path: Path) -> None:
    write_parquet(tmp_path / "log.parquet", signals(100))
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        path = axis(tmp_path, 'log = "log.parquet"', f"{ONE_LINE_DIRECT}[serve]\nport = {port}\n")
        code, checks = doctor(path)
        assert code == 2
        assert checks["dashboard port"]["verdict"] == "failed"
        assert str(port) in checks["dashboard port"]["message"]
    assert doctor(path)[1]["dashboard port"]["verdict"] == "ok"


def test_the_usual_port_that_is_taken_is_a_warning_where_the_configuration_does_not_serve(tmp_path: Path) -> None:
    write_parquet(tmp_path / "log.parquet", signals(100))
    path = axis(tmp_path, 'log = "log.parquet"', ONE_LINE_DIRECT)
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):  # another program may have it already
            stack.enter_context(socket.create_server(("127.0.0.1", 8765)))
        code, checks = doctor(path)
    assert (code, checks["dashboard port"]["verdict"]) == (0, "warning")


@pytest.mark.parametrize(
    ("scheme", "more"),
    [
        ("tcp://127.0.0.1:{port}", ""),
        ("mqtt://127.0.0.1:{port}/t", ""),
        ("opc.tcp://127.0.0.1:{port}", 'rate_hz = 1000\n[source.nodes]\ny = "ns=2;s=y"'),
        ("ads://127.0.0.1:{port}", 'net_id = "5.1.2.3.1.1"\nsymbol = "MAIN.r"\nchannels = ["w", "y"]'),
    ],
)
def test_a_machine_is_reached_or_not(tmp_path: Path, scheme: str, more: str) -> None:
    port = free_port()
    path = axis(tmp_path, f'url = "{scheme.format(port=port)}"\n{more}')
    code, checks = doctor(path)
    assert code == 2
    assert checks["configuration"]["verdict"] == "ok"
    assert checks["source"]["verdict"] == "failed"
    assert f"127.0.0.1:{port}" in checks["source"]["message"]
    with socket.create_server(("127.0.0.1", port)):
        found = doctor(path)[1]["source"]
    assert found["verdict"] == "warning"
    assert f"127.0.0.1:{port}" in found["message"]
    assert "accepts connections, but nothing came within 3 s" in found["message"]


def test_a_device_is_plugged_in_or_not(tmp_path: Path) -> None:
    path = axis(tmp_path, f'url = "serial:{tmp_path}/ttyACM0"')
    code, checks = doctor(path)
    assert code == 2
    assert checks["source"]["verdict"] == "failed"
    assert "there is no such device" in checks["source"]["message"]
    (tmp_path / "ttyACM0").touch()
    assert doctor(path)[1]["source"]["verdict"] == "ok"


def test_a_printer_listens_or_not(tmp_path: Path) -> None:
    path = axis(tmp_path, f'url = "klipper:{tmp_path}/klippy_uds"')
    code, checks = doctor(path)
    assert code == 2
    assert "klippy_uds: No such file" in checks["source"]["message"]
    with closing(socket.socket(socket.AF_UNIX)) as server:
        server.bind(str(tmp_path / "klippy_uds"))
        server.listen()
        assert doctor(path)[1]["source"]["verdict"] == "ok"


def test_a_bus_is_there_or_not(tmp_path: Path) -> None:
    shutil.copy(ROOT / "examples/can/odrive.dbc", tmp_path)
    rest = 'dbc = "odrive.dbc"\nrate_hz = 1000\nchannels = ["Vel_Estimate"]'
    assert doctor(axis(tmp_path, f'url = "can:virtual/1"\n{rest}'))[1]["source"]["verdict"] == "ok"
    for url, words in (("can:socketcan/nocan7", "nocan7"), ("can:nothing/1", "no interface 'nothing'")):
        code, checks = doctor(axis(tmp_path, f'url = "{url}"\n{rest}'))
        assert code == 2
        assert checks["source"]["verdict"] == "failed"
        assert words in checks["source"]["message"]


def test_a_port_that_another_program_receives_udp_on_fails(tmp_path: Path) -> None:
    port = free_port(socket.SOCK_DGRAM)
    path = axis(tmp_path, f'url = "udp://127.0.0.1:{port}"')
    assert doctor(path)[1]["source"]["verdict"] == "warning"  # free, and silent
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as other:
        other.bind(("127.0.0.1", port))
        assert doctor(path)[1]["source"]["verdict"] == "failed"


def test_a_channel_of_a_recording_that_is_constant_empty_or_missing_is_named(tmp_path: Path) -> None:
    given = signals(100)
    path = axis(tmp_path, 'log = "a.parquet"')
    for change, verdict, words in (
        ({"w": np.zeros(100)}, "warning", "channel 'w' is constant at 0"),
        ({"y": np.full(100, np.nan)}, "warning", "channel 'y' is empty"),
        ({"y": None}, "failed", "'y'"),
    ):
        columns = {name: x for name, x in (given | change).items() if x is not None}
        write_parquet(tmp_path / "a.parquet", columns)
        check = doctor(path)[1]["source"]
        assert check["verdict"] == verdict
        assert words in check["message"]


def test_every_channel_of_a_matrix_is_read(tmp_path: Path) -> None:
    given = signals(100)
    path = tmp_path / "axis.toml"
    path.write_text(
        'source.log = "a.parquet"\n[signals]\nexcitation = ["w", "v"]\ninput = ["u", "s"]\noutput = ["y", "z"]\n'
        '[lines]\nfrequencies = "50"\nwindow = 20\n[experiments]\ndwell_periods = 1\n'
    )
    both = given | {"v": given["w"], "s": given["u"], "z": given["y"]}
    for change, verdict in (({}, "ok"), ({"z": np.zeros(100)}, "warning")):
        write_parquet(tmp_path / "a.parquet", both | change)
        check = doctor(path)[1]["source"]
        assert (check["verdict"], "channel 'z' is constant" in check["message"]) == (verdict, bool(change)), check


def test_each_of_several_axes_is_asked_for_its_source(tmp_path: Path) -> None:
    write_parquet(tmp_path / "a.parquet", signals(100))
    path = tmp_path / "axes.toml"
    path.write_text(f'[axes.a.source]\nlog = "a.parquet"\n[axes.b.source]\nlog = "b.parquet"\n{ONE_LINE_DIRECT}')
    checks = doctor(path)[1]
    assert checks["configuration"]["facts"]["axes"] == ["a", "b"]
    assert (checks["source of a"]["verdict"], checks["source of b"]["verdict"]) == ("ok", "failed")
    assert checks["UDP receive buffer"]["verdict"] == "not applicable"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('[source]\nlog = "a"\n[signals]\noutputs = "y"\n', "outputs"),
        ("[source\n", "TOML"),
        ('[source]\nurl = "udp://127.0.0.1:5000"\nrate_hz = 1000\n' + ONE_LINE_DIRECT.replace('"100"', '"101"'), "101"),
        ('[source]\nlog = "a"\n' + ONE_LINE_DIRECT + '[monitoring]\nbaseline = "none.json"\n', "none.json"),
        ('inputs = ["*.csv"]\nrecipe = "none.toml"\nlake = "lake"\n', "there is no file"),
        ('[signals]\noutput = "y"\n', "'source' is missing, so this is not a file that doctor checks"),
        ("[excitation]\nband_hz = [1, 2]\nwhat = 3\n[belt.mechanics]\n", "excitation.what"),
    ],
)
def test_an_invalid_configuration_fails_with_its_sentence(tmp_path: Path, text: str, place: str) -> None:
    path = tmp_path / "some.toml"
    path.write_text(text)
    code, checks = doctor(path)
    assert code == 2
    found = checks["configuration"]
    assert found["verdict"] == "failed"
    assert found["facts"]["code"]
    assert place in found["message"]


@pytest.mark.parametrize(
    ("file", "title"),
    [
        ("examples/experiment.toml", "an experiment"),
        ("src/livebode/interface/example_files/several-motors.toml", "an experiment of several motors"),
        ("wings/plant/src/livebode_plant/example_files/archive.toml", "an archive"),
    ],
)
def test_an_experiment_and_an_archive_are_configurations_too(file: str, title: str) -> None:
    code, checks = doctor(ROOT / file)
    assert checks["configuration"]["message"].endswith(f"is valid: {title}")
    assert checks["configuration"]["verdict"] == "ok"
    assert code == (2 if any(check["verdict"] == "failed" for check in checks.values()) else 0)


def test_a_run_is_read_and_what_is_damaged_is_named(tmp_path: Path) -> None:
    run = small_run(tmp_path, signals())
    found = doctor(run)[1]
    assert found["run"]["verdict"] == "ok"
    assert found["run"]["facts"]["finished"]
    assert found["source"]["verdict"] == "not applicable"  # a finished run needs none
    with (run / "events.jsonl").open("a") as events:
        events.write("rubbish\n")
    damaged = doctor(run)[1]["run"]
    assert (damaged["verdict"], damaged["facts"]["damages"]) == ("warning", 1)
    assert doctor(tmp_path / "no-run")[1]["run"]["verdict"] == "failed"
    (run / "manifest.jsonl").unlink()
    code, found = doctor(run)
    assert (code, found["run"]["verdict"]) == (2, "failed")
    assert found["run"]["message"].startswith("manifest.jsonl of ")
    assert found["run"]["remedy"] == "track the recording again with `livebode run --force`, or restore the file"


def test_two_configurations_at_once_are_refused() -> None:
    with refused(UsageError, "too-many", argument="targets"):
        Subject.of([Path("a.toml"), Path("b.toml")])


def test_a_receive_buffer_that_is_too_small_is_a_warning_with_the_command() -> None:
    found = judged_buffer(212992, 4 << 20)
    assert found.verdict == "warning"
    assert "212992" in found.message
    assert "4194304" in found.remedy


def test_a_full_disk_fails_and_a_small_one_is_a_warning(tmp_path: Path) -> None:
    mount = f"mount -t tmpfs -o size=1m none {tmp_path}"
    allowed = subprocess.run(["unshare", "-Urm", "sh", "-c", mount], capture_output=True, text=True, check=False)
    if allowed.returncode:
        pytest.skip(f"this system lets a user mount no small file system: {allowed.stderr.strip()}")
    done = subprocess.run(
        ["unshare", "-Urm", "sh", "-c", f"{mount} && exec {sys.executable} -c '{FULL_DISK}' {tmp_path}"],
        capture_output=True, text=True, check=False, cwd=ROOT, env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip
    small, _, full = done.stdout.splitlines()
    assert small.startswith("warning ")
    assert full.startswith("failed ")
    assert "the disk is full" in full


def test_a_budget_larger_than_the_free_disk_is_a_warning(tmp_path: Path) -> None:
    assert check_disk(tmp_path, 1 << 60).verdict == "warning"


def test_a_directory_that_cannot_be_written_fails() -> None:
    found = check_disk(Path("/proc/runs"))
    assert found.verdict == "failed"
    assert found.facts == {"path": "/proc"}


def test_versions_are_those_of_the_installed_packages() -> None:
    from livebode.doctor.bundle import versions

    found = versions()
    assert found["packages"]["numpy"] == version("numpy")
    assert found["python"] == sys.version
