"""OPC UA: arrays of samples with source timestamps, from a server's data changes."""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import ConfigError, LivebodeError, SourceError, not_installed
from livebode.sources.live import (
    TICK_S,
    VALUES_MAX,
    Address,
    Batch,
    LiveSource,
    existing,
    named_channels,
    password,
)
from livebode_drives.live.stamp_numbers import StampNumbers
from livebode_drives.source_settings import DriveKeys

REQUEST_S = 5.0
PUBLISH_MS = 50
QUEUE = 1000
"""Size of the server's queue between two publications, in batches."""
INCOMPLETE_MAX = 64
_REFUSALS = (
    "BadCertificate", "BadSecurityChecksFailed", "BadIdentityToken", "BadUserAccessDenied", "BadSecurityPolicyRejected",
    "BadNodeId", "BadUserSignatureInvalid", "BadSecurityModeRejected",
)  # fmt: skip


class StampCollector:
    """Combines the values of one time stamp: one array for each channel, and the number of its first sample.

    At most 64 time stamps wait for missing parts; older ones are dropped and become gaps.
    """

    def __init__(self, nodes: dict[str, str], rate_hz: float, sample_node: str | None) -> None:
        self._keys = list(nodes.values())
        self._channels = named_channels(list(nodes))
        self._rate_hz, self._sample_node = rate_hz, sample_node
        self._required = {*self._keys, *([sample_node] if sample_node else [])}
        self._numbered = StampNumbers(self._channels, rate_hz)
        self._moments: OrderedDict[datetime, dict[str, Any]] = OrderedDict()

    def add(self, key: str, value: Any, stamp: datetime | None) -> Batch | None:
        """Add a new value of node `key`; returns the batch that it completes. SourceError if the values are invalid."""
        if stamp is None:
            raise SourceError(
                "key-missing",
                f"node {key} has no source timestamp",
                "configure the server to send one with each array",
                key="SourceTimestamp",
                node=key,
            )
        number = whole(value) if key == self._sample_node else numbers(value)
        moment = self._moments.setdefault(stamp, {})
        moment[key] = number
        if moment.keys() != self._required:
            while len(self._moments) > INCOMPLETE_MAX:
                self._moments.popitem(last=False)
            return None
        del self._moments[stamp]
        rows = [moment[key] for key in self._keys]
        if len({len(row) for row in rows}) != 1 or not len(rows[0]):
            lengths = [len(row) for row in rows][:8]
            raise SourceError(
                "batch-shape",
                f"the arrays of one time stamp have different lengths {lengths}",
                "configure the server to send arrays of equal length",
                lengths=lengths,
            )
        stamp_s = stamp.replace(tzinfo=stamp.tzinfo or UTC).timestamp()
        first = moment[self._sample_node] if self._sample_node else self._numbered.number(stamp_s, len(rows[0]))
        return Batch(first, np.stack(rows), self._channels, self._rate_hz, 0, stamp_s)


def numbers(value: Any) -> NDArray[np.float64]:
    """A variant's value as samples; a single number is an array of one.

    >>> numbers([1, 2.5]), numbers(True)
    (array([1. , 2.5]), array([1.]))
    """
    values = value if isinstance(value, list) else [value]
    if len(values) > VALUES_MAX or not all(isinstance(x, bool | int | float) for x in values):
        raise wrong_node("a node's value is not an array of numbers, or too long")
    try:
        return np.array(values, dtype=np.float64)
    except OverflowError:
        raise wrong_node("a node's value has a number that is larger than any float") from None


def whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise wrong_node("the value of sample_node is not a whole number")
    return value


def wrong_node(message: str) -> SourceError:
    return SourceError("value-invalid", message, "correct the server's program", key="source.nodes")


class OpcUaSource(LiveSource):
    """Subscribes to one array node for each channel."""

    settings: DriveKeys
    format: ClassVar[str] = "opc ua"

    def __init__(self, settings: DriveKeys, address: Address) -> None:
        super().__init__(settings, address)
        try:
            import asyncua
        except ImportError:
            raise not_installed(
                "opc.tcp needs the package asyncua, which is not installed", package="asyncua", extra="opcua"
            ) from None
        self._asyncua: Any = asyncua
        logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # its messages would repeat our Events
        if not settings.nodes or settings.rate_hz is None:
            raise ConfigError(
                "key-missing",
                "opc.tcp needs source.nodes and source.rate_hz",
                "set them; docs/how-to/live.md describes what the server must have",
                key="source",
                keys=["nodes", "rate_hz"],
            )
        for node in [*settings.nodes.values(), *([settings.sample_node] if settings.sample_node else [])]:
            self._checked_node(node)
        self._password = password(settings.password_env, settings.password_file)
        self._files = self._security_files()

    def _checked_node(self, node: str) -> None:
        try:
            self._asyncua.ua.NodeId.from_string(node)
        except Exception:
            raise ConfigError(
                "value-invalid",
                f"source.nodes has {node[:80]!r}, which is not a node id",
                "give one such as ns=2;s=axis.w",
                key="source.nodes",
                value=node[:80],
            ) from None

    def _security_files(self) -> tuple[str, str, str] | None:
        s = self.settings
        given = {name: getattr(s, name) for name in ("certificate_file", "key_file", "server_certificate_file")}
        if s.security is None:
            if named := [name for name, file in given.items() if file is not None]:
                raise ConfigError(
                    "key-missing",
                    f"source.{named[0]} needs source.security",
                    "set it, such as 'Basic256Sha256'",
                    key="source",
                    keys=["security"],
                )
            return None
        if missing := [name for name, file in given.items() if file is None]:
            raise ConfigError(
                "key-missing",
                f"source.security needs source.{missing[0]}",
                "set it; it authenticates the client",
                key="source",
                keys=missing,
            )
        certificate, key, server = (existing(file, name) for name, file in given.items())
        return certificate, key, server

    def _receive(self) -> bool:
        ua = self._asyncua.ua
        try:
            asyncio.run(self._session())
        except ua.UaError as error:
            name = type(error).__name__
            if name.startswith(_REFUSALS):
                raise SourceError(
                    "refused",
                    f"the server rejected the connection ({name})",
                    "check user, password, certificates and the server's security policies",
                    status=name,
                ) from None
            raise ConnectionError(f"{name}: {error}"[:200]) from None
        return False

    async def _session(self) -> None:
        settings = self.settings
        client = self._asyncua.Client(str(self.address), timeout=REQUEST_S)
        if settings.username is not None:
            client.set_user(settings.username)
        if self._password is not None:
            client.set_password(self._password)
        if self._files is not None:
            await self._secure(client, *self._files)
        assert settings.rate_hz is not None
        gathered = StampCollector(settings.nodes, settings.rate_hz, settings.sample_node)
        required = [*settings.nodes.values(), *([settings.sample_node] if settings.sample_node else [])]
        async with client:
            by_node = {client.get_node(text): text for text in required}
            subscription: Any = await client.create_subscription(PUBLISH_MS, Handler(self, gathered, by_node))
            items = await subscription.subscribe_data_change(list(by_node), queuesize=QUEUE, sampling_interval=0)
            for text, item in zip(by_node.values(), items):
                if isinstance(item, self._asyncua.ua.StatusCode):
                    raise SourceError(
                        "refused",
                        f"the server does not provide node {text} ({item.name})",
                        "check source.nodes",
                        node=text,
                        status=item.name,
                    )
            self._established()
            while not self._stop.is_set():
                await asyncio.sleep(TICK_S)
                await client.check_connection()

    async def _secure(self, client: Any, certificate: str, key: str, server: str) -> None:
        from asyncua.crypto import security_policies, uacrypto

        policy = getattr(security_policies, f"SecurityPolicy{self.settings.security}")
        try:
            expected = await uacrypto.load_certificate(Path(server))
            # Read without security: only the secure connection proves that the server also has the key.
            plain = self._asyncua.Client(str(self.address), timeout=REQUEST_S)
            shown = {endpoint.ServerCertificate for endpoint in await plain.connect_and_get_server_endpoints()}
            expected_is_shown = uacrypto.der_from_x509(expected) in shown  # type: ignore[no-untyped-call]
            if expected_is_shown:
                await client.set_security(policy, certificate, key, server_certificate=server)
        except (ValueError, TypeError) as error:
            raise ConfigError(
                "file-unusable",
                f"a certificate or key of [source] cannot be read: {str(error)[:100]}",
                "check source.certificate_file, source.key_file and source.server_certificate_file",
                key="source",
            ) from None
        if not expected_is_shown:
            raise SourceError(
                "refused",
                "the server shows another certificate than source.server_certificate_file",
                "replace that file if the server has a new certificate",
                key="source.server_certificate_file",
            )


class Handler:
    """Receives data changes from asyncua."""

    def __init__(self, source: OpcUaSource, gathered: StampCollector, by_node: dict[Any, str]) -> None:
        self._source, self._gathered, self._by_node = source, gathered, by_node

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        """A node has a new value."""
        try:
            batch = self._gathered.add(self._by_node[node], value, data.monitored_item.Value.SourceTimestamp)
            if batch is not None:
                self._source._deliver(batch)
        except LivebodeError as error:
            self._source._malformed(error)
