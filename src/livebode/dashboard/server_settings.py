"""Address, tokens and TLS of the dashboard, checked before it starts."""

from __future__ import annotations

import ipaddress
import os
import shlex
import stat
from pathlib import Path

from livebode.configuration import ServeSection
from livebode.core import ConfigError
from livebode.dataclass import dataclass
from livebode.sources.live import secret

TOKEN_LETTERS_MIN = 32
_MAKE = 'umask 077; python -c "import secrets; print(secrets.token_urlsafe(32))"'


@dataclass(frozen=True, repr=False)
class ServerSettings:
    """A ServeSection with the secrets read from their files.

    Attributes
    ----------
    address, port
        Where to listen; port 0 selects a free one.
    names
        Host names, in addition to numeric addresses and localhost, by which a browser may open the page.
    token, viewer_token
        Tokens of operators, who may acknowledge, and of viewers; None if there is none.
    tls
        Context with certificate and key; None for plain HTTP.
    read_only
        Whether nobody may acknowledge.
    language
        Of pages whose user has not chosen one; None: that of the browser.
    """

    address: str
    port: int
    names: tuple[str, ...] = ()
    token: str | None = None
    viewer_token: str | None = None
    tls: tuple[Path, Path] | None = None
    read_only: bool = False
    language: str | None = None

    @classmethod
    def of(cls, section: ServeSection) -> ServerSettings:
        """Build it from the configuration.

        Raises
        ------
        ConfigError
            If a secret or file is missing, a token is too short, or an address other than the loopback lacks a token
            or TLS.
        """
        token = _token("token", section.token_env, section.token_file)
        viewer = _token("viewer_token", section.viewer_token_env, section.viewer_token_file)
        if viewer is not None and viewer == token:
            raise ConfigError(
                "tokens-equal",
                "the tokens of operators and viewers in [serve] are equal, so viewers would be operators",
                "make another token for viewers",
                key="serve.viewer_token_file" if section.viewer_token_file else "serve.viewer_token_env",
            )
        tls = _tls(section)
        if not _loopback(section.address):
            if token is None and viewer is None:
                raise ConfigError(
                    "open-without-token",
                    f"serve.address = {section.address!r} is reachable from the network, which requires a token",
                    f"make one with `{_MAKE}`, put it in a file or the environment, and name "
                    "that as serve.token_file or token_env",
                    key="serve.address",
                    value=section.address,
                )
            if tls is None:
                raise ConfigError(
                    "open-without-tls",
                    f"serve.address = {section.address!r} is reachable from the network, which requires TLS",
                    "give serve.certificate_file and serve.key_file",
                    key="serve.address",
                    value=section.address,
                )
        names = tuple(section.names)
        return cls(section.address, section.port, names, token, viewer, tls, section.read_only, section.language)


def _loopback(address: str) -> bool:
    if address == "localhost":
        return True
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        raise ConfigError(
            "value-invalid",
            f"serve.address = {address!r} is not an IP address",
            "write for example 127.0.0.1, which is only this computer",
            key="serve.address",
            value=address,
        ) from None


def _token(key: str, variable: str | None, path: Path | None) -> str | None:
    token, named = secret("serve", key, variable, path), f"serve.{key}_{'env' if path is None else 'file'}"
    if path is not None:
        _check_rights(key, path)
    if token is None:
        return None
    if len(token) < TOKEN_LETTERS_MIN or not token.isascii() or not token.isprintable() or " " in token:
        raise ConfigError(
            "token-weak",
            f"{named} has no token of at least {TOKEN_LETTERS_MIN} letters and digits",
            f"make one with `{_MAKE}`",
            key=named,
            letters_min=TOKEN_LETTERS_MIN,
        )
    return token


def _check_rights(key: str, path: Path) -> None:
    """ConfigError if other users may read or change the file. Its group may read it, as services share secrets."""
    mode = stat.S_IMODE(path.stat().st_mode)
    if os.name == "posix" and mode & (stat.S_IROTH | stat.S_IWOTH | stat.S_IWGRP):
        raise ConfigError(
            "file-open-to-others",
            f"serve.{key}_file = {str(path)!r} can be read or changed by other users (mode {mode:04o})",
            f"run `chmod 600 {shlex.quote(str(path))}`, and make another token if others may have read it",
            key=f"serve.{key}_file",
            path=str(path),
            mode=mode,
        )


def _tls(section: ServeSection) -> tuple[Path, Path] | None:
    certificate, key = section.certificate_file, section.key_file
    if certificate is None and key is None:
        return None
    if certificate is None or key is None:
        raise ConfigError(
            "key-missing",
            "serve.certificate_file and serve.key_file need each other",
            "give both or none",
            key="serve.certificate_file",
        )
    for path, name in ((certificate, "certificate_file"), (key, "key_file")):
        if not path.is_file():
            raise ConfigError(
                "file-unreadable",
                f"there is no file {path} for serve.{name}",
                "check the name",
                key=f"serve.{name}",
                path=str(path),
            )
    import ssl

    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, password="")
    except (OSError, ValueError) as error:
        raise ConfigError(
            "file-unusable",
            f"{certificate} and {key} are not a certificate and its key in PEM: {error}",
            "convert them, and remove the password of the key",
            key="serve.certificate_file",
            path=str(certificate),
        ) from None
    return certificate, key
