"""What a failed connection means, in one sentence without the address, of which any part may be a secret."""

from __future__ import annotations

import socket
import ssl

from livebode.core import PublishError


def unreachable(error: Exception, timeout_s: float) -> PublishError:
    """The error of a receiver to which there is no connection, or that does not answer."""
    if isinstance(error, TimeoutError):
        return PublishError(
            "unreachable", f"no answer within {timeout_s:g} s", "check the receiver, or increase publish.timeout_s"
        )
    if isinstance(error, ssl.SSLError):
        why = getattr(error, "verify_message", "") or error.reason or "the connection was closed"
        return PublishError("unreachable", f"TLS failed: {why}", "check publish.ca_file and the receiver's certificate")
    if isinstance(error, socket.gaierror):
        return PublishError("unreachable", "its host name is not known", "check the host in publish.url")
    why = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return PublishError("unreachable", f"no connection: {why}", "check that the receiver runs, and publish.url")


def cannot_listen(host: str, port: int, error: OSError) -> PublishError:
    """The error that a server of ours has no port."""
    return PublishError(
        "cannot-listen",
        f"nothing can listen at {host} port {port}: {error.strerror}",
        "choose another port in publish.url, or end the program that uses it",
        port=port,
        errno=error.errno,
    )
