"""Secrets and certificates of a section: read when a connection is made, so that a renewed file counts at once."""

from __future__ import annotations

import ssl
from pathlib import Path

from livebode.configuration import PublishSection, check_url
from livebode.core import ConfigError
from livebode.sources.live import secret


def password(section: PublishSection) -> str | None:
    """The password; ConfigError where the variable is not set or the file cannot be read."""
    return secret("publish", "password", section.password_env, section.password_file)


def token(section: PublishSection) -> str | None:
    """The token; ConfigError as `password`."""
    return secret("publish", "token", section.token_env, section.token_file)


def signing_key(section: PublishSection) -> str | None:
    """The key of the signatures; ConfigError as `password`."""
    return secret("publish", "secret", section.secret_env, section.secret_file)


def address(section: PublishSection) -> tuple[str, str, int, str]:
    """Scheme, host, port and path of the receiver; ConfigError as `password`, or for an address that is not one."""
    url = section.url or secret("publish", "url", section.url_env, section.url_file) or ""
    return check_url(url, section.kind)


def client_tls(section: PublishSection) -> ssl.SSLContext:
    """TLS to a receiver: the trusted authority, and our own certificate if there is one.

    Raises
    ------
    ConfigError
        If a file is missing or is not a certificate or key.
    """
    try:
        context = ssl.create_default_context(cafile=_file(section.ca_file, "ca_file"))
        if section.certificate_file is not None:
            _own_certificate(context, section)
    except ssl.SSLError as error:
        raise _unusable(error) from None
    return context


def server_tls(section: PublishSection) -> ssl.SSLContext | None:
    """TLS of a server of livebode; None without a certificate. ConfigError as `client_tls`."""
    if section.certificate_file is None:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        _own_certificate(context, section)
    except ssl.SSLError as error:
        raise _unusable(error) from None
    return context


def _own_certificate(context: ssl.SSLContext, section: PublishSection) -> None:
    certificate, key = _file(section.certificate_file, "certificate_file"), _file(section.key_file, "key_file")
    assert certificate is not None
    context.load_cert_chain(certificate, key)


def _file(path: Path | None, key: str) -> str | None:
    if path is not None and not path.is_file():
        raise ConfigError(
            "file-unreadable",
            f"there is no file {path} for publish.{key}",
            "check the name",
            key=f"publish.{key}",
            path=str(path),
        )
    return None if path is None else str(path)


def _unusable(error: ssl.SSLError) -> ConfigError:
    return ConfigError(
        "file-unusable",
        f"a certificate or key of [[publish]] cannot be used: {error.reason or error}",
        "check publish.ca_file, publish.certificate_file and publish.key_file",
        key="publish",
    )
