"""A plug-in that cannot be loaded costs one sentence, and nothing else."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path
from urllib.parse import urljoin

import numpy as np
import pytest
from playwright.sync_api import Browser

from livebode import plugins
from livebode_drives.formats import FORMATS
from tests.support import recordings
from tests.support.browser import Tab
from tests.support.command import signals, write_parquet

BROKEN = {
    "missing": ("", "No module named 'livebode_broken'"),
    "fails": ("raise OSError('no licence\\nfor this computer')", "OSError: no licence for this computer"),
    "no table": ("", "has no attribute 'TABLE'"),
    "type": ("TABLE = 5", "is of type int, not a"),
}


@pytest.fixture(params=BROKEN)
def packages(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, str]:
    """A directory of packages with one that is broken in every group, and the reason."""
    code, reason = BROKEN[request.param]
    if request.param != "missing":
        (tmp_path / "livebode_broken.py").write_text(code)
    metadata = tmp_path / "livebode_broken-1.2.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: livebode-broken\nVersion: 1.2\n")
    groups = [f"[livebode.{group}]\nbroken = livebode_broken:TABLE\n" for group in plugins.GROUPS]
    (metadata / "entry_points.txt").write_text("\n".join(groups))
    return tmp_path, reason


def livebode(packages: Path, *words: object) -> subprocess.CompletedProcess[str]:
    code = f"import sys; sys.path.insert(0, {str(packages)!r}); from livebode.cli import main; main()"
    return subprocess.run([sys.executable, "-c", code, *map(str, words)], capture_output=True, text=True, check=False)


def test_everything_else_works_and_each_group_that_is_used_costs_one_sentence(packages: tuple[Path, str]) -> None:
    folder, reason = packages
    log = write_parquet(folder / "log.parquet", signals())
    given = ("--excitation", "w", "--input", "u", "--output", "y", "--lines", "50,100,200", "--window", 100)
    done = livebode(folder, "run", log, *given, "--out", folder / "run")
    assert done.returncode == 0
    said = done.stderr.splitlines()
    assert {line.split(" of the plug-in ")[0] for line in said} <= {
        f"livebode: the {group}" for group in plugins.GROUPS
    }
    assert len(said) == len(set(said)) >= 2
    assert all("livebode-broken 1.2: livebode_broken:TABLE " in line for line in said)
    assert all(reason in line and line.endswith("remove it: pip uninstall livebode-broken") for line in said)


def test_the_tables_are_those_that_importlib_finds(packages: tuple[Path, str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(packages[0])
    declared = {tuple(plugin) for plugin in plugins._declared.__wrapped__()}
    assert declared == {
        (group, entry.dist.name, entry.dist.version, entry.value)
        for group in plugins.GROUPS
        for entry in entry_points(group=f"livebode.{group}")
        if entry.dist is not None
    }
    assert len(declared) > len(plugins.GROUPS)


def test_the_version_does_not_look_for_plugins(packages: tuple[Path, str]) -> None:
    done = livebode(packages[0], "--version")
    assert (done.returncode, done.stderr) == (0, "")


def test_the_doctor_names_it(packages: tuple[Path, str]) -> None:
    folder, reason = packages
    checks = json.loads(livebode(folder, "doctor", "--runs", folder, "--json").stdout)["checks"]
    (check,) = [check for check in checks if check["name"] == "plug-ins"]
    assert check["verdict"] == "warning"
    assert len(check["facts"]["problems"]) == len(plugins.GROUPS)
    assert all(reason in problem for problem in check["facts"]["problems"])


def test_a_name_that_livebode_has_stays_its_own(tmp_path: Path) -> None:
    (tmp_path / "livebode_other.py").write_text("from livebode.cli import Command\nTABLE = {'fit': Command('x')}")
    metadata = tmp_path / "livebode_other-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: livebode-other\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text("[livebode.commands]\nother = livebode_other:TABLE\n")
    assert "Fit a model to the response of a run" in livebode(tmp_path, "--help").stdout
    told = " ".join(livebode(tmp_path, "doctor", "--runs", tmp_path).stdout.split())
    assert "'fit' in the commands of livebode-other is not used" in told


def test_an_error_of_its_command_is_one_line_and_in_the_log(tmp_path: Path) -> None:
    (tmp_path / "livebode_other.py").write_text(
        "from livebode.cli import Command\nfrom livebode.core import UsageError\n"
        "TABLE = {'other': Command('x', 'livebode_other:other')}\n"
        "def other() -> None:\n    raise UsageError('missing', 'nothing is there', 'write it')\n"
    )
    metadata = tmp_path / "livebode_other-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: livebode-other\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text("[livebode.commands]\nother = livebode_other:TABLE\n")
    done = livebode(tmp_path, "other")
    assert (done.returncode, done.stderr) == (2, "livebode: nothing is there; write it\n")
    livebode(tmp_path, "--log-file", tmp_path / "log", "other")
    assert "ERROR livebode.livebode_other: usage.missing: nothing is there" in (tmp_path / "log").read_text("utf-8")


def without(wing: str, *words: object) -> subprocess.CompletedProcess[str]:
    """A command where this wing of livebode was left out of the installation."""
    code = f"import sys; sys.modules['livebode_{wing}'] = None; from livebode.cli import main; main()"
    return subprocess.run([sys.executable, "-c", code, *map(str, words)], capture_output=True, text=True, check=False)


def test_a_wing_that_was_left_out_is_no_fault(tmp_path: Path) -> None:
    axis = tmp_path / "axis.toml"
    axis.write_text('source.log = "log.csv"\nsignals = {input = "u", output = "y"}\n[[publish]]\nkind = "webhook"\n')
    done = without("connect", "doctor", axis, "--receivers", "list")
    assert done.returncode == 2
    assert "publish.kind is 'webhook', which is not supported; install the wing connect of livebode" in done.stderr
    assert "cannot be loaded" not in done.stderr


def test_without_the_wing_control_a_run_has_its_report_and_its_page(tmp_path: Path, browser: Browser) -> None:
    log = write_parquet(tmp_path / "log.parquet", signals())
    given = ["--excitation", "w", "--input", "u", "--output", "y", "--lines", "50,100,200", "--window", "100"]
    code = """
import sys
sys.modules["livebode_control"] = None
from livebode.cli import main
main()
"""

    def without(*words: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", code, *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    assert without("run", log, *given, "--out", tmp_path / "run").returncode == 0
    done = without("report", tmp_path / "run")
    assert (done.returncode, done.stderr) == (0, "")
    assert "No such command 'tune'" in without("tune", tmp_path / "run").stderr
    done = without("report", tmp_path / "run", "--on", log)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "a model is tested by the wing control, which is not installed; install the wing control" in done.stderr
    serve = """
import sys
sys.modules["livebode_control"] = sys.modules["livebode_matrix"] = None
from pathlib import Path
from livebode.dashboard import Dashboard, Serving
dashboard = Dashboard(Serving("127.0.0.1", 0))
dashboard.view(Path(sys.argv[1]))
with dashboard:
    print(dashboard.url, flush=True)
    sys.stdin.read()
"""
    command = [sys.executable, "-c", serve, str(tmp_path / "run")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        with Tab(browser, server.stdout.readline().strip()) as tab:
            tab.until("bode.drawn.measured")
            assert tab.page.locator("#bode-curves").count() == 1
            assert tab.page.locator("[id*=what-if], [id*=matrix]").count() == 0
            assert tab.page.request.get(urljoin(tab.page.url, "/api/loop?axis=0")).status == 404
            assert tab.wrong == []
        server.communicate()


@pytest.mark.parametrize("kind", [format_.reader.partition(":")[0].rpartition(".")[2] for format_ in FORMATS])
def test_a_recording_of_a_wing_that_was_left_out_is_refused(kind: str, tmp_path: Path) -> None:
    path = recordings.write(kind, tmp_path, recordings.with_time(recordings.signals(50)))
    done = without("drives", "inspect", path)
    assert done.returncode == 2
    (sentence,) = done.stderr.splitlines()
    assert sentence.startswith(f"livebode: the format of {path} is not supported (it begins with ")
    assert sentence.endswith("; install the wing drives of livebode, or save its table as CSV")


def test_a_source_and_a_command_of_a_wing_that_was_left_out_are_refused(tmp_path: Path) -> None:
    axis = tmp_path / "axis.toml"
    axis.write_text('source.url = "mqtt://broker/axis"\nsignals = {input = "u", output = "y"}\n')
    done = without("drives", "run", axis)
    assert done.returncode == 2
    assert "source.url has a scheme that is not supported; give one of udp, tcp, stdin" in done.stderr
    assert "No such command 'plc'" in without("drives", "plc").stderr
    assert " plc " not in without("drives", "--help").stdout
    write_parquet(tmp_path / "log.parquet", signals())
    assert without("drives", "inspect", tmp_path / "log.parquet").returncode == 0


def test_without_the_wing_modes_its_section_is_refused_by_one_sentence(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", {"t": np.arange(2000) / 100.0, "y": np.ones(2000)})
    done = without("modes", "run", log, "--output-only", "--output", "y", "--out", tmp_path / "run")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "[output_only] belongs to a kind of estimate that is not installed; install the wing modes" in done.stderr
    assert not (tmp_path / "run").exists()


def test_without_the_wing_design_its_commands_and_its_function_name_the_wing(tmp_path: Path) -> None:
    for name in ("design", "measure"):
        done = without("design", name, tmp_path / "experiment.toml")
        sentence = " ".join(done.stderr.replace("│", " ").split())
        assert done.returncode == 2
        assert f"No such command '{name}'. Its wing may be missing: install the wing design of livebode." in sentence
    assert "choose axis or archive" in without("design", "doctor", "--schema", "experiment").stderr
    code = "import sys; sys.modules['livebode_design'] = None; import livebode; livebode.design({})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.splitlines()[-1] == (
        "livebode.ExtraError: livebode.design belongs to the wing design of livebode, which was left out of the "
        "installation; install the wing design too"
    )


def test_without_the_wing_matrix_a_list_of_channels_is_refused_by_one_sentence(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", signals())
    given = ["--input", "u", "--input", "w", "--output", "y", "--lines", "50,100", "--window", "100"]
    done = without("matrix", "run", log, *given, "--out", tmp_path / "run")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "a list of channels in [signals] belongs to a kind of estimate that is not installed" in done.stderr
    assert "install the wing matrix of livebode" in done.stderr
    assert not (tmp_path / "run").exists()
    assert "a gantry" not in without("matrix", "example").stdout


def test_without_the_wing_of_many_machines_its_commands_and_examples_do_not_exist() -> None:
    commands = ("--help", "example", "fleet status", "doctor --schema archive", "doctor --schema axis")
    answers = {words: without("plant", *words.split()) for words in commands}
    assert [done.returncode for done in answers.values()] == [0, 0, 2, 2, 0]
    assert not any("cannot be loaded" in done.stderr for done in answers.values())
    assert "fleet" not in answers["--help"].stdout
    assert "standstill" in answers["example"].stdout
    assert "hall" not in answers["example"].stdout
    assert "No such command 'fleet'" in answers["fleet status"].stderr
    assert "choose axis or experiment or matrix-experiment" in answers["doctor --schema archive"].stderr


def test_without_the_wing_reports_its_commands_and_the_page_say_what_to_install(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", signals())
    given = ["--excitation", "w", "--input", "u", "--output", "y", "--lines", "50,100,200", "--window", "100"]
    done = without("reports", "run", log, *given, "--out", tmp_path / "run")
    assert (done.returncode, done.stderr) == (0, "")
    for command in ("report", "compare"):
        done = without("reports", command, tmp_path / "run")
        assert done.returncode == 2
        sentence = "Its wing may be missing: install the wing reports of livebode."
        assert f"No such command '{command}'." in done.stderr
        assert sentence in " ".join(done.stderr.replace("│", " ").split())
    code = """
import sys
sys.modules["livebode_reports"] = None
from livebode.core import ExtraError, document_function
try:
    document_function("comparison")
except ExtraError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stderr, done.stdout) == (
        "",
        "documents are made by the wing reports of livebode, which is not installed; "
        "install the wing reports of livebode\n",
    )
