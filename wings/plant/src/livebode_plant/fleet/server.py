"""A nats-server of our own on loopback: for the demonstration, the tests and the fault campaign."""

from __future__ import annotations

import contextlib
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path
from typing import Self

from livebode.core import FleetError
from livebode_plant.fleet.server_config import OPEN, ClusterMember, ServerAccess, server_configuration

_START_S, _STEP_S = 10.0, 0.02
_given: set[int] = set()


class NatsServer:
    """A nats-server with its configuration and its log in a directory; a context manager.

    Parameters
    ----------
    directory
        Created if it is missing.
    port
        At which it listens on the loopback.
    configuration
        Its text.

    Raises
    ------
    FleetError
        At the start, if nats-server is not installed or ends at once.
    """

    def __init__(self, directory: Path, port: int, configuration: str) -> None:
        self._directory, self._port = directory, port
        self._process: subprocess.Popen[bytes] | None = None
        directory.mkdir(parents=True, exist_ok=True)
        self._configuration = directory / "nats.conf"
        self._configuration.write_text(configuration)

    def start(self) -> None:
        """Start it and wait until it listens."""
        program = shutil.which("nats-server")
        if program is None:
            raise FleetError(
                "server-missing",
                "nats-server is not installed on this computer",
                "install it: on Debian with `apt-get install nats-server`",
            )
        with (self._directory / "nats.log").open("ab") as log:
            self._process = subprocess.Popen([program, "-c", str(self._configuration)], stdout=log, stderr=log)
        until = time.monotonic() + _START_S
        while not self._listens():
            if self._process.poll() is not None or time.monotonic() > until:
                self.kill()
                raise FleetError(
                    "server-ended",
                    f"nats-server did not start; its log is {self._directory / 'nats.log'}",
                    "read its last lines",
                    path=str(self._directory / "nats.log"),
                )
            time.sleep(_STEP_S)

    def reload(self) -> None:
        """Let it read its configuration again."""
        assert self._process is not None
        self._process.send_signal(signal.SIGHUP)

    def kill(self) -> None:
        """End it at once, as a fault of its computer does; its store remains."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None:
            self._process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(5)
        self.kill()

    def _listens(self) -> bool:
        try:
            socket.create_connection(("127.0.0.1", self._port), 0.2).close()
        except OSError:
            return False
        return True


class LogServer(NatsServer):
    """The server of a log on a free port of loopback, with its store in a directory.

    Parameters
    ----------
    directory
        Where configuration, store and log of the server are.
    partitions
        Of the fleet.
    file_bytes_max
        Most bytes of all streams.
    access
        Who may do what. Default: everyone everything.
    member
        Which server of a cluster it is. Default: the only one.
    """

    def __init__(
        self,
        directory: Path,
        partitions: int,
        file_bytes_max: int = 4 << 30,
        access: ServerAccess = OPEN,
        member: ClusterMember | None = None,
    ) -> None:
        port, self._scheme = free_port(), "nats" if access.server.certificate is None else "tls"
        text = server_configuration(
            directory / "store",
            partitions=partitions,
            port=port,
            host="127.0.0.1",
            file_bytes_max=file_bytes_max,
            access=access,
            member=member,
        )
        super().__init__(directory, port, text)

    @property
    def url(self) -> str:
        return f"{self._scheme}://127.0.0.1:{self._port}"


def free_port() -> int:
    """A port of the loopback at which nothing listens, and that was not given before: servers bind theirs later."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = int(found.getsockname()[1])
        if port not in _given:
            _given.add(port)
            return port
        return free_port()  # while this one is bound, so that it is another
