"""Debian's InfluxDB has the points that were sent, whatever letters they contain, and each once."""

from __future__ import annotations

import json
import subprocess
import urllib.parse
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from livebode.configuration import PublishSection
from livebode.publishing import AxisValues, EventMessage, Measurement
from livebode_connect.influxdb import InfluxSink
from tests.support.peers.peer import free_port, program, until
from tests.support.receivers import configured

NASTY = ['a "b"', "c\\d", "e, f=g h", "Ölüberdruck µ ∞", "two\nlines", "end\\", "'; DROP DATABASE axes", "=", "#"]
SETTINGS = """reporting-disabled = true
bind-address = "127.0.0.1:{rpc}"
[meta]
  dir = "{folder}/meta"
[data]
  dir = "{folder}/data"
  wal-dir = "{folder}/wal"
[http]
  bind-address = "127.0.0.1:{port}"
[monitor]
  store-enabled = false
"""


class Database:
    """A server with a database `axes`, and the rows that it returns."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        settings = folder / "influxdb.conf"
        settings.write_text(SETTINGS.format(rpc=free_port(), folder=folder, port=self.port))
        with (folder / "influxdb.log").open("wb") as log:
            self.process = subprocess.Popen([program("influxd"), "-config", settings], stdout=log, stderr=log)
        try:
            until(self._created, "the database")
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        self.process.kill()
        self.process.wait()

    def _created(self) -> bool:
        try:
            self.query("CREATE DATABASE axes", post=True)
        except OSError:
            return False
        return True

    def query(self, text: str, *, post: bool = False) -> list[dict[str, Any]]:
        """The points of all series."""
        asked = urllib.parse.urlencode({"db": "axes", "q": text, "epoch": "ns"})
        url = f"http://127.0.0.1:{self.port}/query?{asked}"
        with urllib.request.urlopen(url, data=b"" if post else None) as answer:
            (result,) = json.load(answer)["results"]
        return [dict(zip(one["columns"], row)) for one in result.get("series", []) for row in one["values"]]


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    found = Database(tmp_path_factory.mktemp("influxdb"))
    yield found
    found.close()


def section(database: Database) -> PublishSection:
    return configured({"kind": "influxdb", "url": f"http://127.0.0.1:{database.port}/write?db=axes"}).publish[0]


def one_line(text: str) -> str:
    return text.replace("\n", " ")


def test_events_with_any_letters_are_points_and_one_that_is_sent_again_replaces_itself(database: Database) -> None:
    events = [
        EventMessage(f"{number:016x}", text, "", "r", "gap", "alarm", "medium", text, text, 1.8e9, number, 2.5, "%")
        for number, text in enumerate(NASTY)
    ]
    sink = InfluxSink(section(database))
    for _ in range(2):
        sink.send_events(events)
    sink.close()
    rows = sorted(database.query("SELECT * FROM livebode_event"), key=lambda row: row["sample"])
    assert [(row["message"], row["cause"]) for row in rows] == [(one_line(text), one_line(text)) for text in NASTY]
    assert [row["axis"] for row in rows] == [one_line(text).rstrip("\\") for text in NASTY]
    assert {row["value"] for row in rows} == {2.5}
    assert all(abs(row["time"] - 1_800_000_000 * 10**9) < 1000 for row in rows)


def test_results_are_numbers_of_their_kind(database: Database) -> None:
    columns: dict[str, list[Any]] = {
        name: [1.5, 2.5] for name in ("frequency_hz", "real", "imag", "sigma", "coherence")
    }
    values = AxisValues(
        "x 1", "plant/press 4", "r", 1.8e9,
        (Measurement("Keff", "N m/rad", 1234.5678901234567, 0.1), Measurement("zeta", "", None, None)),
        columns | {"valid": [True, False]},
        "plant", "N m", {"state": "tracking", "samples": 3, "rate_hz": 4000.0}, (),
    )  # fmt: skip
    sink = InfluxSink(section(database))
    sink.send_values([values])
    sink.close()
    (row,) = database.query("SELECT * FROM livebode")
    assert (row["axis"], row["machine"], row["state"], row["samples"]) == ("x 1", "plant/press 4", "tracking", 3)
    assert (row["Keff"], row["Keff_bound"]) == (1234.5678901234567, 0.1)
    lines = database.query("SELECT * FROM livebode_response")
    assert [(one["frequency_hz"], one["real"], one["valid"]) for one in lines] == [
        ("1.5", 1.5, True),
        ("2.5", 2.5, False),
    ]
