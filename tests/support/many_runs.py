"""A directory of runs of one machine over weeks, and how a test asks its server."""

from __future__ import annotations

import json
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

import numpy as np

from livebode.core import moment
from livebode.language import Message
from livebode.monitoring.sentences import WHAT
from livebode.simulation.two_mass_loop import RATE_HZ
from tests.support.dashboards import FIT, LOOP, SAMPLES, data
from tests.support.peers.peer import PATIENCE_S
from tests.support.runs import small_run
from tests.support.shared import folder, shared
from tools.run_copies import copy_run

BEGUN, DAY_S = 1_760_000_000.0, 86400.0
SOFTER = 0.9
ALARM = Message(
    "Since {since} {change}.",
    since=moment(1.0),
    change=Message(
        "{part} is {size} % {way} than {reference}",
        part=WHAT["stiffness"],
        size=Message("{size:.1f} ± {bound:.1f}", size=10.0, bound=0.3),
        way=Message("less"),
        reference=Message("in the baseline"),
    ),
)
HEALTHY = Message("No change against the baseline ({judged_s:.1f} s of the run judged).", judged_s=3.0)
MONITORED = {"baseline": "healthy.json", "judged_s": 3.0, "changes": 0, "standing": []}
CHANGED = MONITORED | {"baseline": "other.json", "changes": 1, "standing": [{"what": "stiffness"}]}
MONITORED |= {"message": HEALTHY, "words": HEALTHY.plain()}
CHANGED |= {"message": ALARM, "words": ALARM.plain()}


@shared
def source_run() -> Path:
    """A run in one piece with fits and margins, to be copied."""
    w, u, y, _ = data()
    columns = {"t": np.arange(SAMPLES) / RATE_HZ, "w": w, "u": u, "y": y}
    made = folder() / "many-runs"
    made.mkdir()
    lines = {"frequencies": "20:140:10", "window": 400}
    small_run(made, columns, lines=lines, fit=FIT, loop=LOOP, tracking={"hop": 200})
    return made / "run"


def weeks(source: Path, folder: Path) -> Path:
    """Six daily runs, the belt softer from the fourth on, with an alarm; one without a clock, and a broken one."""
    for i in range(6):
        factors = {"Keff": SOFTER} if i > 2 else {}
        copy_run(
            source, folder / f"day {i}", begun=BEGUN + i * DAY_S, factors=factors, alarm=ALARM if i > 2 else "",
            changes={"monitoring": CHANGED if i > 2 else MONITORED},
        )  # fmt: skip
    copy_run(source, folder / "no clock")
    (folder / "broken").mkdir()
    (folder / "broken" / "run.json").write_text("{}")
    (folder / "a file").write_text("")
    (folder / ".hidden").mkdir()
    (folder / "not a run").mkdir()
    (folder / "link").symlink_to(folder / "day 0", target_is_directory=True)
    return folder


def ask(url: str, path: str, body: Any = None, token: str = "", **headers: str) -> tuple[int, dict[str, str], Any]:
    """Status, headers and body (JSON as objects) of a request, a POST if it has a body; with Origin as a browser."""
    parts = urlsplit(url)
    connection = HTTPConnection(parts.hostname or "", parts.port, timeout=PATIENCE_S)
    sent = {"Origin": url.rstrip("/")} | ({"Authorization": f"Bearer {token}"} if token else {})
    data = None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    if data is not None:
        sent["Content-Type"] = "application/json"
    connection.request("GET" if data is None else "POST", path, data, sent | headers)
    answer = connection.getresponse()
    text = answer.read().decode("utf-8", "replace")
    kind = answer.getheader("content-type", "")
    found = answer.status, {k.lower(): v for k, v in answer.getheaders()}, json.loads(text) if "json" in kind else text
    connection.close()
    return found


def run_page(name: str) -> str:
    """Path of the page of a run."""
    return f"/run/{quote(name, safe='')}/"
