"""A plug-in that cannot be loaded costs one sentence, and nothing else."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from importlib.metadata import entry_points
from pathlib import Path
from urllib.parse import urljoin

import numpy as np
import pytest
from playwright.sync_api import Browser

from livebode import plugins
from livebode.dashboard import plugin_pages
from livebode.sources.live import Address, LiveSource, SourceSettings
from livebode_drives.formats import FORMATS
from tests.support import recordings
from tests.support.answers import Answer, answers
from tests.support.browser import Tab
from tests.support.command import signals, write_parquet

BROKEN = {
    "missing": ("", "No module named 'livebode_broken'"),
    "fails": ("raise OSError('no licence\\nfor this computer')", "OSError: no licence for this computer"),
    "no table": ("", "has no attribute 'TABLE'"),
    "type": ("TABLE = 5", "is of type int, not a"),
}


NO_PICTURES = ["matplotlib"]
RUN = ("--excitation", "w", "--input", "u", "--output", "y", "--lines", "50,100,200", "--window", 100)


@pytest.fixture(scope="module", params=BROKEN)
def packages(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A directory of packages with one that is broken in every group, and the reason."""
    folder = tmp_path_factory.mktemp("packages")
    code, reason = BROKEN[request.param]
    if request.param != "missing":
        (folder / "livebode_broken.py").write_text(code)
    metadata = folder / "livebode_broken-1.2.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: livebode-broken\nVersion: 1.2\n")
    groups = [f"[livebode.{group}]\nbroken = livebode_broken:TABLE\n" for group in plugins.GROUPS]
    (metadata / "entry_points.txt").write_text("\n".join(groups))
    return folder, reason


@pytest.fixture(scope="module")
def broken(packages: tuple[Path, str]) -> dict[str, Answer]:
    """Answers to a run and to the doctor, who names what the run has found too."""
    folder, _ = packages
    log = write_parquet(folder / "log.parquet", signals())
    run, doctor = answers(
        ("run", log, *RUN, "--out", folder / "run"), ("doctor", "--runs", folder, "--json"),
        absent=NO_PICTURES, path=[folder],
    )  # fmt: skip
    return {"run": run, "doctor": doctor}


def livebode(packages: Path, *words: object) -> subprocess.CompletedProcess[str]:
    code = f"import sys; sys.path.insert(0, {str(packages)!r}); from livebode.cli import main; main()"
    return subprocess.run([sys.executable, "-c", code, *map(str, words)], capture_output=True, text=True, check=False)


def test_everything_else_works_and_each_group_that_is_used_costs_one_sentence(
    packages: tuple[Path, str], broken: dict[str, Answer]
) -> None:
    _, reason = packages
    assert broken["run"].code == 0
    said = broken["run"].err.splitlines()
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


def test_a_page_without_an_addition_that_cannot_be_loaded_has_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    additions = dict(plugins.named("pages"))
    monkeypatch.setattr(plugin_pages, "named", lambda _: {"other": "livebode_absent.page:Addition"} | additions)
    with pytest.warns(plugins.PluginWarning, match="'other' is not on the page: livebode_absent.page:Addition"):
        files = plugin_pages.files_of_additions({})
    assert [name in files["additions.js"].decode() for name in ("whatIf", "other")] == [True, False]


def test_the_help_has_the_same_sentence(packages: tuple[Path, str], broken: dict[str, Answer]) -> None:
    done = livebode(packages[0], "--help")
    assert "Fit a model to the response of a run" in done.stdout
    (line,) = done.stderr.splitlines()
    assert line in broken["run"].err.splitlines()


def test_the_version_does_not_look_for_plugins(packages: tuple[Path, str]) -> None:
    done = livebode(packages[0], "--version")
    assert (done.returncode, done.stderr) == (0, "")


def test_the_doctor_names_it(packages: tuple[Path, str], broken: dict[str, Answer]) -> None:
    _, reason = packages
    checks = json.loads(broken["doctor"].out)["checks"]
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
    help_, doctor = answers(["--help"], ["doctor", "--runs", tmp_path], path=[tmp_path])
    assert "Fit a model to the response of a run" in help_.out
    assert "'fit' in the commands of livebode-other is not used" in " ".join(doctor.out.split())


def write_command(tmp_path: Path, error: str) -> None:
    """A plug-in with the command "other", which raises an error."""
    (tmp_path / "livebode_other.py").write_text(
        "from livebode.cli import Command\nfrom livebode.core import UsageError\n"
        "TABLE = {'other': Command('x', 'livebode_other:other')}\n"
        f"def other() -> None:\n    raise {error}\n"
    )
    metadata = tmp_path / "livebode_other-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: livebode-other\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text("[livebode.commands]\nother = livebode_other:TABLE\n")


def test_an_error_of_its_command_is_one_line_and_in_the_log(tmp_path: Path) -> None:
    write_command(tmp_path, "UsageError('missing', 'nothing is there', 'write it')")
    done = livebode(tmp_path, "other")
    assert (done.returncode, done.stderr) == (2, "livebode: nothing is there; write it\n")
    livebode(tmp_path, "--log-file", tmp_path / "log", "other")
    assert "ERROR livebode.livebode_other: usage.missing: nothing is there" in (tmp_path / "log").read_text("utf-8")


class Device(LiveSource):
    """A source that does not say whether its device is there."""

    format = "device"

    def _receive(self) -> bool:
        return True


def test_a_device_is_not_sought_in_the_network() -> None:
    reach = Device(SourceSettings(url="stdin:"), Address("device", path="/dev/axis")).reach()
    assert (reach.verdict, reach.remedy) == ("not applicable", "")
    assert "/dev/axis" in reach.message


def test_an_internal_error_of_its_command_names_it(tmp_path: Path) -> None:
    write_command(tmp_path, "KeyError('odd')")
    done = livebode(tmp_path, "other")
    assert done.returncode == 1
    assert "KeyError: 'odd'" in done.stderr
    sentence = "livebode: internal error in the plug-in livebode-other 1; "
    assert done.stderr.splitlines()[-1] == f"{sentence}please report it to its authors with the lines above"


def without(wing: str, *commands: Sequence[object], others: Sequence[str] = ()) -> list[Answer]:
    """Commands where this wing of livebode was left out of the installation, and other packages are not installed."""
    return answers(*commands, absent=[f"livebode_{wing}", *others])


def words(text: str) -> str:
    """Text of a panel on one line."""
    return " ".join(text.replace("|", " ").split())


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_parquet(tmp_path / "log.parquet", signals())


def test_a_wing_that_was_left_out_is_no_fault(tmp_path: Path) -> None:
    axis = tmp_path / "axis.toml"
    axis.write_text('source.log = "log.csv"\nsignals = {input = "u", output = "y"}\n[[publish]]\nkind = "webhook"\n')
    (done,) = without("connect", ["doctor", axis, "--receivers", "list"])
    assert done.code == 2
    assert "publish.kind is 'webhook', which is not supported; install the wing connect of livebode" in done.err
    assert "cannot be loaded" not in done.err


def test_without_the_wing_control_a_run_has_its_report_and_its_page(
    log: Path, tmp_path: Path, browser: Browser
) -> None:
    run, report, tune, tested = without(
        "control",
        ["run", log, *RUN, "--out", tmp_path / "run"],
        ["report", tmp_path / "run"],
        ["tune", tmp_path / "run"],
        ["report", tmp_path / "run", "--on", log],
    )
    assert run.code == 0
    assert (report.code, report.err) == (0, "")
    assert "No such command 'tune'" in tune.err
    assert (tested.code, tested.err.count("\n")) == (2, 1)
    assert "a model is tested by the wing control, which is not installed; install the wing control" in tested.err
    serve = """
import sys
sys.modules["livebode_control"] = sys.modules["livebode_matrix"] = None
from pathlib import Path
from livebode.dashboard import Dashboard, ServerSettings
dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
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


def test_recordings_of_a_wing_that_was_left_out_are_refused(tmp_path: Path) -> None:
    kinds = [format_.reader.partition(":")[0].rpartition(".")[2] for format_ in FORMATS]
    paths = [recordings.write(kind, tmp_path, recordings.with_time(recordings.signals(50))) for kind in kinds]
    for path, done in zip(paths, without("drives", *(["inspect", path] for path in paths)), strict=True):
        assert done.code == 2
        (sentence,) = done.err.splitlines()
        assert sentence.startswith(f"livebode: the format of {path} is not supported (it begins with ")
        assert sentence.endswith("; install the wing drives of livebode, or save its table as CSV")


def test_a_source_and_a_command_of_a_wing_that_was_left_out_are_refused(log: Path, tmp_path: Path) -> None:
    axis = tmp_path / "axis.toml"
    axis.write_text('source.url = "mqtt://broker/axis"\nsignals = {input = "u", output = "y"}\n')
    run, plc, help_, inspect = without("drives", ["run", axis], ["plc"], ["--help"], ["inspect", log])
    assert run.code == 2
    assert "source.url has a scheme that is not supported; give one of udp, tcp, stdin" in run.err
    assert "No such command 'plc'" in plc.err
    assert " plc " not in help_.out
    assert inspect.code == 0


def test_without_the_wing_modes_its_section_is_refused_by_one_sentence(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", {"t": np.arange(2000) / 100.0, "y": np.ones(2000)})
    (done,) = without("modes", ["run", log, "--output-only", "--output", "y", "--out", tmp_path / "run"])
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "[output_only] belongs to a kind of estimate that is not installed; install the wing modes" in done.err
    assert not (tmp_path / "run").exists()


def test_without_the_wing_design_its_commands_and_its_function_name_the_wing(tmp_path: Path) -> None:
    names = "design", "measure"
    *refused, schema = without(
        "design", *([name, tmp_path / "experiment.toml"] for name in names), ["doctor", "--schema", "experiment"]
    )
    for name, done in zip(names, refused, strict=True):
        sentence = f"No such command '{name}'. Its wing may be missing: install the wing design of livebode."
        assert done.code == 2
        assert sentence in words(done.err)
    assert "choose axis or archive" in schema.err
    code = "import sys; sys.modules['livebode_design'] = None; import livebode; livebode.design({})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.splitlines()[-1] == (
        "livebode.ExtraError: livebode.design belongs to the wing design of livebode, which was left out of the "
        "installation; install the wing design too"
    )


def test_without_the_wing_matrix_a_list_of_channels_is_refused_by_one_sentence(log: Path, tmp_path: Path) -> None:
    given = ["--input", "u", "--input", "w", "--output", "y", "--lines", "50,100", "--window", "100"]
    done, example = without("matrix", ["run", log, *given, "--out", tmp_path / "run"], ["example"])
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "a list of channels in [signals] belongs to a kind of estimate that is not installed" in done.err
    assert "install the wing matrix of livebode" in done.err
    assert not (tmp_path / "run").exists()
    assert "a gantry" not in example.out


def test_without_the_wing_of_many_machines_its_commands_and_examples_do_not_exist() -> None:
    commands = ("--help", "example", "fleet status", "doctor --schema archive", "doctor --schema axis")
    given = dict(zip(commands, without("plant", *(command.split() for command in commands))))
    assert [done.code for done in given.values()] == [0, 0, 2, 2, 0]
    assert not any("cannot be loaded" in done.err for done in given.values())
    assert "fleet" not in given["--help"].out
    assert "standstill" in given["example"].out
    assert "hall" not in given["example"].out
    assert "No such command 'fleet'" in given["fleet status"].err
    assert "choose axis or experiment or matrix-experiment" in given["doctor --schema archive"].err


def test_without_the_wing_reports_its_commands_and_the_page_say_what_to_install(log: Path, tmp_path: Path) -> None:
    run, *refused = without(
        "reports",
        ["run", log, *RUN, "--out", tmp_path / "run"],
        *([command, tmp_path / "run"] for command in ("report", "compare")),
        others=NO_PICTURES,
    )
    assert (run.code, run.err) == (0, "")
    for command, done in zip(("report", "compare"), refused, strict=True):
        assert done.code == 2
        assert f"No such command '{command}'." in done.err
        assert "Its wing may be missing: install the wing reports of livebode." in words(done.err)
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
