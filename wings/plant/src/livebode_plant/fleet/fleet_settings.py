"""fleet.toml: the axes of a fleet, its log, and how it is divided."""

from __future__ import annotations

from collections.abc import Mapping
from glob import glob
from pathlib import Path
from typing import Annotated, Literal, Self
from urllib.parse import urlsplit

from pydantic import Field

from livebode.configuration import Axis, ConfigurationFile, File
from livebode.core import ConfigError, FleetError, on_loopback
from livebode_plant.fleet.subjects import axis_key
from livebode_plant.settings_section import SettingsFile, SettingsSection, place_beside

PARTITIONS_MAX = 1024
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
PublicKey = Annotated[str, Field(pattern=r"^U[A-Z2-7]{55}$")]


class LogSection(SettingsSection):
    """[log]: the server of the log, and how much it retains.

    Parameters
    ----------
    url
        Address of nats-server; several of a cluster are joined by commas. Off the loopback it begins with tls://.
    credentials
        File with the secret key of this user, relative to this file; `livebode fleet setup --user` writes it.
    authority
        Certificate of the authority that signed the server's certificate, in PEM, relative to this file. Default: the
        authorities that this computer trusts.
    access
        "view" with the key of a viewer, which may read the status and the acknowledgements only; "send" for edges
        behind a leaf node.
    size_gb
        Most data of the machines in the log, in GB; the oldest are deleted then. It must be well below the disk.
    results_gb
        Most data of results in the log, in GB; the oldest are deleted then.
    age_days
        Longest time that data of the machines are in the log.
    replicas
        Copies of the log in a cluster of servers: 3 survive the loss of one.
    axis_messages
        Most messages of one axis in the log; its own oldest are deleted then, so that one edge cannot displace the data
        of the others. Default: ten per second for a week.
    """

    url: str = "nats://127.0.0.1:4222"
    credentials: File | None = None
    authority: File | None = None
    access: Literal["full", "view", "send"] = "full"
    size_gb: Positive = 50.0
    results_gb: Positive = 10.0
    age_days: Positive = 7.0
    replicas: Annotated[int, Field(ge=1, le=5)] = 1
    axis_messages: Annotated[int, Field(ge=1)] = 6_048_000

    @property
    def encrypted(self) -> bool:
        """Whether the connection uses TLS."""
        return self.url.startswith("tls://")

    def checked(self) -> None:
        """ConfigError if the address is not one of nats-server, has a password, or is not encrypted on a network."""
        for url in self.url.split(","):
            parts = urlsplit(url)
            if parts.username is not None:
                raise ConfigError(
                    "secret-in-url",
                    "log.url contains a user or a password",
                    "remove it, and set log.credentials to the file with the key",
                    key="log.url",
                )
            if parts.scheme not in ("nats", "tls") or not parts.hostname:
                raise ConfigError(
                    "value-invalid",
                    f"log.url = {url!r} is neither tls://HOST:PORT nor nats://HOST:PORT",
                    "correct it",
                    key="log.url",
                    value=url,
                )
            if parts.scheme == "nats" and (self.encrypted or not on_loopback(parts.hostname)):
                raise ConfigError(
                    "log-open",
                    f"the log at {url} is reached over a network without TLS",
                    "write log.url as tls://HOST:PORT, and set log.credentials and log.authority",
                    key="log.url",
                    value=url,
                )


class ServerSection(SettingsSection):
    """[server]: what `livebode fleet setup` writes into the configuration of nats-server.

    Parameters
    ----------
    certificate
        Certificate of the server in PEM, relative to this file. Required off the loopback.
    key
        Its private key in PEM, relative to this file.
    cluster
        Addresses HOST:PORT at which the servers of a cluster reach each other, all of them in the same order.
    authority
        Certificate of the authority that signed those of the other servers of the cluster, in PEM, relative to this
        file. Required off the loopback, and for leaf nodes.
    leaf_port
        Port at which the leaf nodes of sites connect. Default: none.
    """

    certificate: File | None = None
    key: File | None = None
    cluster: list[Annotated[str, Field(pattern=r"^[^\s:/]+:\d{1,5}$")]] = []
    authority: File | None = None
    leaf_port: Annotated[int, Field(ge=1, le=65535)] | None = None


class LeafSection(SettingsSection):
    """[leaf]: the server of a site, which `livebode fleet setup --leaf` configures.

    Parameters
    ----------
    url
        Address of the log's server for leaf nodes, tls://HOST:PORT; several of a cluster are joined by commas.
    certificate
        Certificate of the site in PEM, relative to this file; its name is in users.leaves of the log's server.
    key
        Its private key in PEM, relative to this file.
    authority
        Certificate of the authority that signed the one of the log's server, in PEM, relative to this file.
    """

    url: str
    certificate: File | None = None
    key: File | None = None
    authority: File | None = None

    @property
    def urls(self) -> list[str]:
        """The addresses one by one."""
        return self.url.split(",")


class UsersSection(SettingsSection):
    """[users]: public keys of those who may use the log. Without a key everyone on this computer may.

    Parameters
    ----------
    fleet
        Of workers and of commands that check or replay: everything.
    view
        Of viewers: the status and the acknowledgements.
    edges
        Of edges, by the path of their axes: "Graz" may send those of a site, "Graz/2/press 4/x" one axis.
    leaves
        Of leaf nodes, by the path of their axes: the names in their certificates.
    """

    fleet: list[PublicKey] = []
    view: list[PublicKey] = []
    edges: dict[str, list[PublicKey]] = {}
    leaves: dict[str, list[Annotated[str, Field(pattern=r"^[\w.-]+$")]]] = {}


class EdgeSection(SettingsSection):
    """[edge]: what `livebode fleet send` retains while the log cannot be reached.

    Parameters
    ----------
    buffer
        Directory of the buffer, relative to this file.
    buffer_gb
        Most data in it; the oldest are deleted then, and counted.
    """

    buffer: Annotated[Path, Field(strict=False)] = Path("edge-buffer")
    buffer_gb: Positive = 2.0


class SinkSection(SettingsSection):
    """[sink]: what `livebode fleet sink` stores of the results, and for how long.

    Parameters
    ----------
    lake
        Directory, relative to this file, or URL of the lake, such as "s3://plant/lake".
    full_rate_days
        How long every response and every fit is retained.
    minute_days
        How long means over a minute are retained. Those over an hour, events and raw data around alarms remain.
    commit_s
        Longest time from reading a result until it is in the lake: a short one gives many small files.
    """

    lake: Annotated[str, Field(min_length=1)] | None = None
    full_rate_days: Positive = 7.0
    minute_days: Positive = 730.0
    commit_s: Positive = 60.0

    @property
    def url(self) -> str:
        """The lake; ConfigError if it is missing."""
        if self.lake is None:
            raise ConfigError(
                "key-missing",
                "'sink.lake' is missing",
                'add [sink] with lake = "DIRECTORY" or a URL such as "s3://plant/lake"',
                key="sink.lake",
            )
        return self.lake

    def beside(self, folder: Path) -> Self:
        """The section with a path of the lake relative to a folder."""
        return self.model_copy(update={"lake": self.lake and place_beside(folder, self.lake)})


class FleetSettings(SettingsFile):
    """A fleet.

    Parameters
    ----------
    axes
        Files of axes, relative to this file, or patterns such as "axes/*.toml". Each axis has a [machine] section.
    partitions
        Number of parts that workers share. It must not change while the log has data.
    workers
        Number of processes that `livebode fleet run` starts.
    """

    axes: Annotated[list[str], Field(min_length=1)]
    partitions: Annotated[int, Field(ge=1, le=PARTITIONS_MAX)] = 16
    workers: Annotated[int, Field(ge=1, le=256)] = 2
    log: LogSection = LogSection()
    edge: EdgeSection = EdgeSection()
    sink: SinkSection = SinkSection()
    server: ServerSection = ServerSection()
    leaf: LeafSection | None = None
    users: UsersSection = UsersSection()

    def check_values(self) -> None:
        """ConfigError if the address of the log is not usable."""
        self.log.checked()

    def beside(self, folder: Path) -> Self:
        """The settings with their paths relative to a folder."""
        axes = [str(folder / pattern) for pattern in self.axes]
        return super().beside(folder).model_copy(update={"axes": axes})

    def read_axes(self) -> dict[str, Axis]:
        """The axes by their key in the log.

        Raises
        ------
        ConfigError
            If a file cannot be read, or no file has a name like a pattern.
        FleetError
            If an axis has no [machine] section, or two have the same.
        """
        found: dict[str, Axis] = {}
        for pattern in self.axes:
            paths = sorted(glob(pattern))
            if not paths:
                raise ConfigError("file-unreadable", f"there is no file {pattern}", "check the name", path=pattern)
            for path in paths:
                _add(found, ConfigurationFile(Path(path), {}).read(), path)
        return found


def machine_key(axis: Axis, origin: str) -> str:
    """The key of an axis in the log; FleetError if it has no [machine] section."""
    if axis.machine is None or not axis.machine.path:
        raise FleetError(
            "axis-unnamed",
            "the axis has no [machine] section",
            "add [machine] with site, line, machine or axis",
            key="machine",
        ).at(origin)
    return axis_key(axis.machine)


def _add(found: dict[str, Axis], axes: Mapping[str, Axis], path: str) -> None:
    for name, axis in axes.items():
        origin = f"{path}, axis {name}" if name else path
        key = machine_key(axis, origin)
        if key in found:
            assert axis.machine is not None
            raise FleetError(
                "axis-duplicated",
                f"another axis of the fleet is {axis.machine.path!r} too",
                "rename one of them in [machine]",
                axis=axis.machine.path,
            ).at(origin)
        found[key] = axis
