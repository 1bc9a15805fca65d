"""The connection to the server of the log: encrypted and with a key off the loopback, or refused with the reason."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from livebode.core.errors import FleetError
from livebode.core.installing import not_installed
from livebode.fleet.credentials import checked_credentials
from livebode.fleet.settings import LogSection

if TYPE_CHECKING:
    from nats.aio.client import Client

_START_S = 4.0
_RENEWED: dict[str, Any] = {
    "connect_timeout": 2.0,
    "max_reconnect_attempts": -1,
    "reconnect_time_wait": 0.2,
    "ping_interval": 2,
    "max_outstanding_pings": 2,
    "allow_reconnect": True,
}


async def connected(settings: LogSection, name: str, report: Callable[[Exception], None]) -> Client:
    """A connection that is renewed whenever it breaks; `report` gets what is wrong meanwhile.

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

        from livebode.fleet.encrypted_client import EncryptedClient
    except ImportError:
        raise not_installed("the log of a fleet needs nats-py, which is not installed", "nats-py", "fleet") from None
    options = _security(settings)
    reasons: list[Exception] = []

    async def note(error: Exception) -> None:
        reasons[:] = [error]
        report(error)

    connection = EncryptedClient() if settings.encrypted else Client()
    connecting = connection.connect(settings.url.split(","), name=name, error_cb=note, **_RENEWED, **options)
    try:
        await asyncio.wait_for(connecting, _START_S)
    except (TimeoutError, OSError, Error) as error:
        raise _refused(settings, reasons[0] if reasons else error) from None
    return connection


def _security(settings: LogSection) -> dict[str, Any]:
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


def _refused(settings: LogSection, error: Exception) -> FleetError:
    from nats.errors import SecureConnRequiredError

    reason, key = str(error) or type(error).__name__, settings.credentials
    if isinstance(error, ssl.SSLCertVerificationError):
        return FleetError(
            "log-untrusted",
            f"the certificate of the log at {settings.url} is not trusted: {error.verify_message}",
            "set log.authority to the certificate of the authority that signed it, and write the name in it into "
            "log.url",
            url=settings.url,
        )
    if isinstance(error, SecureConnRequiredError):
        return FleetError(
            "log-untrusted",
            f"the log at {settings.url} does not offer TLS",
            "set server.certificate and server.key, write its configuration with `livebode fleet server`, and restart "
            "it",
            url=settings.url,
        )
    if "authorization" in reason.lower():
        return FleetError(
            "log-refused",
            f"the log at {settings.url} {'needs a key' if key is None else f'does not accept the key {str(key)!r}'}",
            "set log.credentials to a key whose public part is in [users] of the server's configuration",
            url=settings.url,
        )
    return FleetError(
        "log-unreachable",
        f"the log at {settings.url} cannot be reached ({reason})",
        "check that nats-server runs there, and the url in [log]",
        url=settings.url,
    )
