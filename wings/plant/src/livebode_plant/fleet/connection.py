"""The connection to the server of the log: encrypted and with a key off the loopback, or refused with the reason."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import secrets
import shlex
import ssl
import stat
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.core import FleetError, not_installed
from livebode_plant.fleet.fleet_settings import LogSection

if TYPE_CHECKING:
    from nats.aio.client import Client

_SEED = re.compile(rb"SU[A-Z2-7]{56}\s*")
_SEED_BYTES = 32


def write_credentials(path: Path) -> str:
    """Make a key, write its secret part to a new file that only this user may read, and return its public part.

    Raises
    ------
    FleetError
        If the file exists or cannot be written.
    ExtraError
        If nkeys is not installed.
    """
    try:
        import nkeys
    except ImportError:
        raise not_installed("keys of a log need nkeys, which is not installed", "nkeys", "fleet") from None
    seed = nkeys.encode_seed(secrets.token_bytes(_SEED_BYTES), nkeys.PREFIX_BYTE_USER)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(seed + b"\n")
    except OSError as error:
        raise FleetError(
            "credentials-unusable",
            f"the key {str(path)!r} cannot be written: {error.strerror or error}",
            "choose another directory, or another name: a key is never replaced",
            path=str(path),
        ) from None
    public: bytes = nkeys.from_seed(bytearray(seed)).public_key
    return public.decode()


def checked_credentials(path: Path) -> str:
    """The path as text, if it is a file with a secret key that other users cannot read.

    Raises
    ------
    FleetError
        Otherwise; the message never has the content.
    """
    try:
        mode, content = stat.S_IMODE(path.stat().st_mode), path.read_bytes()
    except OSError as error:
        raise _unusable(path, f"cannot be read: {error.strerror}", "check its name in log.credentials") from None
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        command = f"chmod 600 {shlex.quote(str(path))}"
        change = f"run `{command}`, and make another key if others may have read it"
        raise _unusable(path, f"can be used by other users (mode {mode:04o})", change)
    if not _SEED.fullmatch(content):
        raise _unusable(path, "has no secret key of a user", "make one with `livebode fleet setup`")
    return str(path)


def _unusable(path: Path, what: str, change: str) -> FleetError:
    return FleetError("credentials-unusable", f"the key {str(path)!r} {what}", change, path=str(path))


_START_S, _CLOSE_S = 4.0, 0.2
_RENEWED: dict[str, Any] = {
    "connect_timeout": 2.0,
    "max_reconnect_attempts": -1,
    "reconnect_time_wait": 0.2,
    "ping_interval": 2,
    "max_outstanding_pings": 2,
    "allow_reconnect": True,
}


async def connected(
    settings: LogSection, name: str, report: Callable[[Exception], None], **callbacks: Callable[[], Awaitable[None]]
) -> Client:
    """A connection that is renewed whenever it breaks; `report` gets what is wrong meanwhile.

    The `callbacks` of nats-py are called when it breaks, and when it is renewed.

    Raises
    ------
    ConfigError
        If the address is not encrypted on a network.
    FleetError
        If the server cannot be reached within some seconds, or does not accept the key, or its certificate is not
        trusted; or if a file with a key or a certificate cannot be used.
    ExtraError
        If nats-py is not installed.
    """
    settings.checked()
    try:
        from nats.aio.client import Client
        from nats.errors import Error

        from livebode_plant.fleet.encrypted_client import EncryptedClient
    except ImportError:
        raise not_installed("the log of a fleet needs nats-py, which is not installed", "nats-py", "fleet") from None
    options = security(settings)
    connection = EncryptedClient() if settings.encrypted else Client()
    attempts = _Attempts(settings, report)
    options |= _RENEWED | callbacks | {"name": name, "error_cb": attempts.failed}
    connecting = connection.connect(settings.url.split(","), **options)
    try:
        await asyncio.wait_for(connecting, 2 * _START_S)
    except (_GivenUpError, TimeoutError, OSError, Error) as error:
        with contextlib.suppress(TimeoutError, OSError, Error):  # it may wait for the end of a failed handshake
            await asyncio.wait_for(connection.close(), _CLOSE_S)
        raise _unreachable(settings, attempts.errors or [error]) from None
    attempts.over = True
    return connection


class _GivenUpError(Exception):
    """No attempt to connect has succeeded in time, or one was refused with a reason that will not pass."""


class _Attempts:
    """The attempts to connect for the first time, which end from within: nats-py may miss a cancellation."""

    def __init__(self, settings: LogSection, report: Callable[[Exception], None]) -> None:
        self._settings, self._report = settings, report
        self._until_s = time.monotonic() + _START_S
        self.errors: list[Exception] = []
        self.over = False

    async def failed(self, error: Exception) -> None:
        """An attempt has failed, or later the connection has."""
        self._report(error)
        if self.over:
            return
        self.errors.append(error)
        alone = "," not in self._settings.url
        if time.monotonic() > self._until_s or (alone and _refusal(self._settings, error) is not None):
            raise _GivenUpError


def security(settings: LogSection) -> dict[str, Any]:
    """Options of nats-py for the key and TLS; FleetError if a file with a key or a certificate cannot be used."""
    options: dict[str, Any] = {}
    if settings.credentials is not None:
        options["nkeys_seed"] = checked_credentials(settings.credentials)
    if settings.encrypted:
        try:
            options["tls"] = ssl.create_default_context(cafile=settings.authority)
        except OSError as error:
            raise FleetError(
                "authority-unusable",
                f"the certificate {str(settings.authority)!r} cannot be used: {error.strerror or error}",
                "set log.authority to the certificate of the authority in PEM",
                path=str(settings.authority),
            ) from None
    return options


def _unreachable(settings: LogSection, errors: list[Exception]) -> FleetError:
    """The error with the reason that says most: some attempts of those until the timeout end with less."""
    for error in errors:
        refusal = _refusal(settings, error)
        if refusal is not None:
            return refusal
    reasons = [str(error) for error in errors if str(error)]
    return FleetError(
        "log-unreachable",
        f"the log at {settings.url} cannot be reached ({reasons[0] if reasons else type(errors[0]).__name__})",
        "check that nats-server runs there, and the url in [log]",
        url=settings.url,
    )


def _refusal(settings: LogSection, error: Exception) -> FleetError | None:
    from nats.errors import SecureConnRequiredError

    url, key = settings.url, settings.credentials
    if isinstance(error, ssl.SSLCertVerificationError):
        return FleetError(
            "log-untrusted",
            f"the certificate of the log at {url} is not trusted: {error.verify_message}",
            "set log.authority to the certificate of the authority that signed it, and write the name in it into "
            "log.url",
            url=url,
        )
    if isinstance(error, SecureConnRequiredError):
        return FleetError(
            "log-untrusted",
            f"the log at {url} does not offer TLS",
            "set server.certificate and server.key, and restart it with what `livebode fleet setup` writes",
            url=url,
        )
    if "authorization" in str(error).lower():
        return FleetError(
            "log-refused",
            f"the log at {url} {'needs a key' if key is None else f'does not accept the key {str(key)!r}'}",
            "set log.credentials to a key whose public part is in [users] of the server's configuration",
            url=url,
        )
    return None
