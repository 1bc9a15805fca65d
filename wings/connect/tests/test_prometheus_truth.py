"""The metrics of axes, as Prometheus's own parser reads them."""

from __future__ import annotations

import socket
import ssl
import urllib.request
from pathlib import Path
from typing import Any

import pytest
import trustme
from prometheus_client.parser import text_string_to_metric_families

import livebode
from livebode.core import Event
from tests.support.certificates import certified
from tests.support.peers.peer import PATIENCE_S
from tests.support.receivers import PublishedAxis, free_port, until


def scraped(url: str, tls: ssl.SSLContext | None = None) -> dict[str, list[tuple[dict[str, str], float]]]:
    with urllib.request.urlopen(url, timeout=PATIENCE_S, context=tls) as answer:
        families = list(text_string_to_metric_families(answer.read().decode()))
    found: dict[str, list[tuple[dict[str, str], float]]] = {}
    for family in families:
        for sample in family.samples:
            found.setdefault(sample.name, []).append((sample.labels, sample.value))
    return found


def section(port: int, **keys: Any) -> dict[str, Any]:
    return {"kind": "prometheus", "url": f"http://127.0.0.1:{port}", "interval_s": 0.1} | keys


def test_parameters_bounds_alarms_and_counts_are_metrics(tmp_path: Path) -> None:
    port = free_port()
    sent = section(port, values=["parameters", "responses", "status"])
    with PublishedAxis(tmp_path, sent, machine={"line": "2"}) as axis:
        axis.measure()
        axis.change(-2.0)
        axis.feed(Event("gap", 0, 0.0, "over when it is reported"))
        found = until(lambda: _answered(port), "metrics")
    responses = livebode.example_responses()[-2:]
    fits = livebode.Fitter("two-mass").process(responses)
    (keff,) = [value for of, value in found["livebode_parameter"] if of["name"] == "Keff"]
    (bound,) = [value for of, value in found["livebode_parameter_bound"] if of["name"] == "Keff"]
    assert (keff, bound) == (fits["Keff"][-1], fits.bound(0.95)[-1, fits.index("Keff")])
    assert found["livebode_responses_total"] == [({"axis": "x", "machine": "2"}, 2.0)]
    assert found["livebode_alarm"] == [
        ({"axis": "x", "machine": "2", "cause": "change: stiffness", "kind": "change", "priority": "high"}, 1.0)
    ]
    magnitudes = {float(of["frequency_hz"]): value for of, value in found["livebode_response_magnitude"]}
    assert magnitudes == pytest.approx(dict(zip(responses.lines.frequency_hz.tolist(), abs(responses.value[-1]))))


def _answered(port: int) -> Any:
    try:
        found = scraped(f"http://127.0.0.1:{port}/metrics")
    except OSError:
        return None
    return found if "livebode_alarm" in found and "livebode_parameter" in found else None


def test_a_port_that_is_taken_does_not_stop_the_run_and_is_used_when_it_is_free(tmp_path: Path) -> None:
    files = certified(tmp_path / "tls", trustme.CA())
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        tls = {"certificate_file": str(files["certificate"]), "key_file": str(files["key"])}
        axis = PublishedAxis(tmp_path, section(port, name="metrics", **tls))
        down = until(lambda: axis.reported("sink-down"), "the report")
        assert f"nothing can listen at 127.0.0.1 port {port}" in down[0].message
    with axis:
        until(lambda: axis.reported("sink-up"), "the port")
        trusted = ssl.create_default_context(cafile=str(files["authority"]))
        found = scraped(f"https://127.0.0.1:{port}/metrics", trusted)
    assert found["livebode_info"][0][0]["version"] == livebode.__version__
