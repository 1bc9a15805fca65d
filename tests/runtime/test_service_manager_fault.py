"""What a service manager learns of a run: a real one on a real socket, and one whose axis or process stands still."""

from __future__ import annotations

import select
import signal
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from livebode.configuration import Axis
from livebode.runtime import Destination, Session
from livebode.runtime.service_manager import ServiceManager
from livebode.sources.live import SourceSettings
from tests.support.live_session import Stuck
from tests.support.peers.machine import Machine
from tests.support.peers.peer import PATIENCE_S, batches, until
from tests.support.peers.plain import TcpPeer
from tests.support.session_process import SHARED, Running, source

WATCHDOG_S = 0.4
QUIET_S = 1.0
"""Ten times the interval of the reports."""


class Manager:
    """The socket of a service manager."""

    def __init__(self, address: str) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(address)
        self._socket.settimeout(PATIENCE_S)

    def __enter__(self) -> Manager:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def state(self) -> str:
        """The next change of state."""
        while (message := self._message()) == "WATCHDOG=1":
            pass
        return message

    def report(self) -> None:
        """The next report to the watchdog."""
        while self._message() != "WATCHDOG=1":
            pass

    def quiet(self) -> bool:
        """Whether there is no message for some time."""
        heard, _, _ = select.select([self._socket], [], [], QUIET_S)
        return not heard or not self._message()

    def _message(self) -> str:
        return self._socket.recv(4096).decode()


@pytest.fixture
def manager(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Manager]:
    address = str(tmp_path / "notify")
    monkeypatch.setenv("NOTIFY_SOCKET", address)
    monkeypatch.setenv("WATCHDOG_USEC", str(round(WATCHDOG_S * 1e6)))
    with Manager(address) as found:
        yield found


def test_a_run_reports_ready_work_reload_and_stop_and_nothing_while_the_process_stands_still(
    tmp_path: Path, manager: Manager
) -> None:
    with Machine(tmp_path) as machine, Running(tmp_path, f"{SHARED}[axes.x]\n{source(machine)}") as running:
        assert manager.state() == "READY=1"
        until(lambda: (running.out / "x/run.json").exists(), "the run")
        machine.silence()
        manager.report()  # a machine that sends nothing is no fault of the run
        running.process.send_signal(signal.SIGHUP)
        assert manager.state().startswith("RELOADING=1\nMONOTONIC_USEC=")
        assert manager.state() == "READY=1"
        running.process.send_signal(signal.SIGSTOP)
        until(manager.quiet, "a process that stands still")
        running.process.send_signal(signal.SIGCONT)
        manager.report()
        running.end()
        assert manager.state() == "STOPPING=1"


def test_the_watchdog_hears_nothing_while_one_of_two_axes_stands_still(tmp_path: Path, manager: Manager) -> None:
    stuck, sent = Stuck(), batches(12, first=0)
    folders = {name: tmp_path / name for name in "ab"}
    for folder in folders.values():
        folder.mkdir()

    def to(name: str, _: Axis) -> Destination:
        return Destination(tmp_path / "run" / name, lambda *_: None, subscribers=(stuck,) if name == "a" else ())

    with TcpPeer(folders["a"]) as a, TcpPeer(folders["b"]) as b:
        peers = {"a": a, "b": b}
        axes = {
            name: Axis.of(
                {
                    "source": SourceSettings(**peer.settings).model_dump(exclude_unset=True),
                    "signals": {"output": "y", "input": "w"}, "lines": {"frequencies": "100", "window": 400},
                    "tracking": {"estimator": "direct"},
                }, "test",
            )
            for name, peer in peers.items()
        }  # fmt: skip
        session = Session(axes, to, report=lambda *_: None, leave=lambda *_: None)
        thread = threading.Thread(target=session.run)
        thread.start()
        for peer in peers.values():
            peer.wait_ready()
            for batch in sent:
                peer.send(batch)
        assert manager.state() == "READY=1"
        assert stuck.held.wait(PATIENCE_S)
        until(manager.quiet, "a report that is missing")
        stuck.released.set()
        manager.report()
        session.end()
        thread.join()
    assert manager.state() == "STOPPING=1"


def test_a_manager_with_an_abstract_address_is_reached_and_one_that_is_gone_changes_nothing() -> None:
    address = "livebode-test-of-the-service-manager"
    with Manager(f"\0{address}") as manager:
        ours = ServiceManager({"NOTIFY_SOCKET": f"@{address}"})
        ours.ready()
        ours.working()  # without a watchdog
        ours.stopping()
        assert [manager.state(), manager.state()] == ["READY=1", "STOPPING=1"]
    ours.ready()
    ServiceManager({}).ready()
    assert ServiceManager({"WATCHDOG_USEC": "4000000", "WATCHDOG_PID": "1"}).patience_s == 0.0
