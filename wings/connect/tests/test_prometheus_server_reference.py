"""Debian's Prometheus and Alertmanager with the files of examples/prometheus: an alarm becomes a message."""

from __future__ import annotations

import json
import re
import subprocess
import urllib.parse
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from livebode.publishing import AxisValues, Measurement
from livebode.publishing.messages import AlarmNow
from livebode_connect.prometheus import metrics
from tests.support.peers.peer import PATIENCE_S, program
from tests.support.receivers import HttpReceiver, PublishedAxis, free_port, until

FILES = Path(__file__).parents[3] / "examples" / "prometheus"
STATUS = {
    "state": "tracking",
    "samples": 1,
    "responses": 1,
    "lost": 0,
    "rate_hz": 1.0,
    "latency_s": 0.1,
    "behind_s": 0.0,
}
VALUES = AxisValues(
    "x", "", "r", 0.0, (Measurement("Keff", "N/m", 1.0, 0.1),),
    {"frequency_hz": [1.0], "real": [1.0], "imag": [0.0], "valid": [True]}, "plant", "",
    STATUS, (AlarmNow("change", "change", "high", "changed", 0.0),),
)  # fmt: skip


def dashboard() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((FILES / "grafana-dashboard.json").read_text("utf-8"))
    return found


def queries() -> list[str]:
    """The queries of the dashboard, with its variables replaced as Grafana replaces All."""
    return [re.sub(r"\$\w+", ".*", target["expr"]) for panel in dashboard()["panels"] for target in panel["targets"]]


def test_rules_and_dashboard_use_metrics_and_labels_that_exist() -> None:
    exported = {sample.name: set(sample.labels) for family in metrics([VALUES]) for sample in family.samples}
    texts = [*queries(), (FILES / "livebode-rules.yml").read_text("utf-8")]
    used = {name for text in texts for name in re.findall(r"livebode_\w+", text)}
    assert used
    assert used <= exported.keys()
    for text in texts:
        for name, labels in re.findall(r"(livebode_\w+)\{([^}]*)\}", text):
            assert set(re.findall(r"(\w+)=", labels)) <= exported[name], name


def test_the_dashboard_has_the_form_that_grafana_imports() -> None:
    found = dashboard()
    assert {"title", "uid", "panels", "schemaVersion", "templating", "time"} <= found.keys()
    assert found["id"] is None  # else an import replaces another dashboard
    ids = [panel["id"] for panel in found["panels"]]
    assert len(set(ids)) == len(ids)
    taken: set[tuple[int, int]] = set()
    for panel in found["panels"]:
        at = panel["gridPos"]
        cells = {(x, y) for x in range(at["x"], at["x"] + at["w"]) for y in range(at["y"], at["y"] + at["h"])}
        assert at["x"] + at["w"] <= 24
        assert not cells & taken, panel["title"]
        taken |= cells
        assert {"type", "title", "datasource", "fieldConfig", "options", "targets"} <= panel.keys()
        references = [target["refId"] for target in panel["targets"]]
        assert len(set(references)) == len(references)


def test_promtool_and_amtool_accept_the_files_and_the_queries_of_the_dashboard(tmp_path: Path) -> None:
    rules = [{"record": f"panel:{number}", "expr": query} for number, query in enumerate(queries())]
    (tmp_path / "queries.yml").write_text(json.dumps({"groups": [{"name": "panels", "rules": rules}]}))
    for command in (
        [program("promtool"), "check", "config", FILES / "prometheus.yml"],
        [program("promtool"), "check", "rules", tmp_path / "queries.yml"],
        [program("amtool"), "check-config", FILES / "alertmanager.yml"],
    ):
        result = subprocess.run(command, capture_output=True, text=True)
        assert result.returncode == 0, result.stdout + result.stderr


@contextmanager
def running(folder: Path, name: str, *options: str) -> Iterator[None]:
    with (folder / f"{name}.log").open("wb") as log:
        process = subprocess.Popen([program(name), *options], stdout=log, stderr=log, cwd=folder)
        try:
            yield
        finally:
            process.kill()
            process.wait()


@pytest.fixture
def ports() -> dict[str, int]:
    return {name: free_port() for name in ("prometheus", "alertmanager", "livebode")}


def written(folder: Path, ports: dict[str, int], receiver: int) -> None:
    """The files of the example with the ports of this test, and short times."""
    changes = {"9464": ports["livebode"], "9093": ports["alertmanager"], "5001": receiver, "10s": "1s", "5m": "2s"}
    for name in ("prometheus.yml", "alertmanager.yml", "livebode-rules.yml"):
        text = (FILES / name).read_text("utf-8")
        for old, new in changes.items() if name != "livebode-rules.yml" else ():
            text = text.replace(old, str(new))
        (folder / name).write_text(text)


def test_an_alarm_of_an_axis_reaches_the_receiver_of_alertmanager(tmp_path: Path, ports: dict[str, int]) -> None:
    with HttpReceiver() as receiver:
        written(tmp_path, ports, receiver.port)
        address = {name: f"127.0.0.1:{port}" for name, port in ports.items()}
        options = {
            "prometheus": ("--config.file=prometheus.yml", "--storage.tsdb.path=data"),
            "prometheus-alertmanager": ("--config.file=alertmanager.yml", "--cluster.listen-address="),
        }
        section = {"kind": "prometheus", "url": f"http://{address['livebode']}", "interval_s": 0.2}
        with (
            PublishedAxis(tmp_path, section, machine={"machine": "press"}) as axis,
            running(tmp_path, "prometheus-alertmanager", *options["prometheus-alertmanager"],
                    f"--web.listen-address={address['alertmanager']}", "--storage.path=alerts"),
            running(tmp_path, "prometheus", *options["prometheus"], f"--web.listen-address={address['prometheus']}"),
        ):  # fmt: skip
            axis.measure()
            axis.change(-2.0)
            alerts = until(lambda: receiver.posted and json.loads(receiver.posted[0][2]), "the alert")
            query = urllib.parse.urlencode({"query": 'livebode_parameter{name="Keff"}'})
            with urllib.request.urlopen(
                f"http://{address['prometheus']}/api/v1/query?{query}", timeout=PATIENCE_S
            ) as answer:
                (result,) = json.load(answer)["data"]["result"]
    (alert,) = alerts["alerts"]
    assert alert["labels"]["alertname"] == "LivebodeAlarm"
    assert alert["annotations"]["summary"] == "press x: change: stiffness"
    assert result["metric"]["unit"] == "N m/rad"
    assert float(result["value"][1]) > 0
