"""The package of examples/plugin, built as a wheel and installed into a fresh environment: each of its parts works."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import numpy as np
import pytest

from livebode.records import RunRecord
from tests.support.command import RATE_HZ, signals
from tests.support.small_axis import SMALL_AXIS

EXAMPLE = Path(__file__).parents[2] / "examples/plugin"


class Installed:
    """An environment with the example, beside the packages of this one."""

    def __init__(self, folder: Path) -> None:
        shutil.copytree(EXAMPLE, folder / "plugin")  # the build writes beside its source
        pip = [sys.executable, "-m", "pip", "--quiet", "--no-cache-dir"]
        wheel = [*pip, "wheel", "--no-deps", "--no-index", "--no-build-isolation", "-w", folder, folder / "plugin"]
        subprocess.run(wheel, check=True)
        venv.create(folder / "env")
        self.python = folder / "env/bin/python"
        (packages,) = (folder / "env").glob("lib/python*/site-packages")
        (packages / "these.pth").write_text(f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})\n")
        (built,) = folder.glob("*.whl")
        subprocess.run([*pip, "--python", self.python, "install", "--no-deps", "--no-index", built], check=True)

    def answer(self, *words: object) -> subprocess.CompletedProcess[str]:
        """What livebode answers there."""
        code = "from livebode.cli import main; main()"
        command = [self.python, "-c", code, *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    def livebode(self, *words: object) -> str:
        """What livebode prints there."""
        done = self.answer(*words)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    return Installed(tmp_path_factory.mktemp("plugin"))


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plant of gain 2."""
    columns = signals()
    path = tmp_path_factory.mktemp("trace") / "axis.trace"
    header = " ".join(["TRACE1", str(RATE_HZ), *columns])
    np.savetxt(path, np.column_stack([*columns.values()]), header=header, comments="")
    return path


def gain(run: Path) -> np.ndarray:
    return np.abs(RunRecord.open(run).responses()[-1].value)


def test_its_own_tests_pass(installed: Installed) -> None:
    subprocess.run([installed.python, "-m", "pytest", "-q", "-p", "no:cacheprovider", EXAMPLE / "tests"], check=True)


def test_its_reader_reads_a_recording_and_its_command_prints_it(installed: Installed, trace: Path) -> None:
    (trace.parent / "axis.toml").write_text(f'source.log = "{trace.name}"\n{SMALL_AXIS}')
    installed.livebode("run", trace.parent / "axis.toml", "--out", trace.parent / "run")
    np.testing.assert_allclose(gain(trace.parent / "run"), 2, rtol=0.02)
    assert installed.livebode("trace", trace) == f"{trace}: 1000 Hz: t [], w [], u [], y []\n"
    assert "Print rate and channels of a trace." in installed.livebode("--help")


def test_its_command_refuses_what_is_no_trace_by_one_sentence(installed: Installed, tmp_path: Path) -> None:
    done = installed.answer("trace", tmp_path / "absent.trace")
    assert (done.returncode, "does not exist" in done.stderr) == (2, True)
    (tmp_path / "axis.trace").write_text("1 2\n3 4\n")
    done = installed.answer("trace", tmp_path / "axis.trace")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "its first line is not TRACE1" in done.stderr


def test_its_source_is_tracked_live_and_its_receiver_gets_the_events(installed: Installed, trace: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(60)
        publish = f'[[publish]]\nkind = "datagram"\nurl = "udp://127.0.0.1:{receiver.getsockname()[1]}"\n'
        axis = trace.parent / "live.toml"
        axis.write_text(f'source.url = "trace:{trace}"\n{SMALL_AXIS}{publish}')
        installed.livebode("run", axis, "--out", trace.parent / "live")
        (source,) = (check for check in checks(installed, axis) if check["name"] == "source")
        assert source["verdict"] == "ok"
        event = json.loads(receiver.recv(1 << 16))
    assert event["run"] == "live"
    np.testing.assert_allclose(gain(trace.parent / "live"), 2, rtol=0.02)
    code = f"import livebode; print(livebode.Run({str(trace.parent / 'live')!r}).analysis('trace-duration')())"
    done = subprocess.run([installed.python, "-c", code], capture_output=True, text=True, check=True)
    assert 1 < float(done.stdout) < 2


def checks(installed: Installed, *configuration: Path) -> list[dict[str, str]]:
    """The checks of the doctor."""
    found: list[dict[str, str]] = json.loads(installed.livebode("doctor", *configuration, "--json"))["checks"]
    return found


def test_the_doctor_lists_it_with_its_version(installed: Installed) -> None:
    (check,) = (check for check in checks(installed) if check["name"] == "plug-ins")
    listed = "livebode-trace 1.0.0 (readers, sources, sinks, commands, analyses)"
    assert (check["verdict"], check["message"]) == ("ok", listed)
