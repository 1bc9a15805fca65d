"""HttpPost: requests to one address over a connection that remains open."""

from __future__ import annotations

import http.client
from collections.abc import Mapping

from livebode import __version__
from livebode.core import PublishError
from livebode.publishing import PublishSection, address, client_tls, token, unreachable

_NOT_TAKEN = {400, 413, 415, 422}
"""Answers about the message itself: sending it again would not change them."""
_ANSWER_BYTES_MAX = 1 << 16


class HttpPost:
    """Posts to the address of a section. A redirect counts as refused: a message goes where the section says.

    Parameters
    ----------
    section
        With address, TLS, token and timeout.
    scheme
        Of the Authorization header, in front of the token.

    Raises
    ------
    ConfigError
        If a secret or certificate of the section cannot be read.
    """

    def __init__(self, section: PublishSection, scheme: str) -> None:
        self._section, self._scheme = section, scheme
        self._connection: http.client.HTTPConnection | None = None
        address(section), token(section)
        if section.ca_file is not None or section.certificate_file is not None:
            client_tls(section)

    def post(self, body: bytes, headers: Mapping[str, str]) -> None:
        """Send one request; PublishError if it is not answered with a code from 200 to 299."""
        _, host, port, path = address(self._section)
        if (bearer := token(self._section)) is not None:
            headers = {**headers, "Authorization": f"{self._scheme} {bearer}"}
        headers = {"User-Agent": f"livebode/{__version__}", **headers}
        kept = self._connection is not None
        try:
            code, answer = self._request(host, port, path or "/", body, headers)
        except (OSError, http.client.HTTPException) as error:
            self.close()
            if not kept or isinstance(error, TimeoutError):
                raise unreachable(error, self._section.timeout_s) from None
            self.post(body, headers)  # the receiver closed the idle connection
            return
        if not 200 <= code <= 299:
            self.close()
            raise _refusal(code, answer)

    def close(self) -> None:
        """Close the connection."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _request(self, host: str, port: int, path: str, body: bytes, headers: Mapping[str, str]) -> tuple[int, bytes]:
        if self._connection is None:
            timeout_s = self._section.timeout_s
            if address(self._section)[0] == "https":
                self._connection = http.client.HTTPSConnection(
                    host, port, timeout=timeout_s, context=client_tls(self._section)
                )
            else:
                self._connection = http.client.HTTPConnection(host, port, timeout=timeout_s)
        self._connection.request("POST", path, body, dict(headers))
        response = self._connection.getresponse()
        answer = response.read(_ANSWER_BYTES_MAX)
        if response.length:  # more than is read: the connection cannot be used again
            self.close()
        return response.status, answer


def _refusal(code: int, answer: bytes) -> PublishError:
    """The error of an answer; its text is shown in part, because it may be a page."""
    words = " ".join("".join(c if c.isprintable() else " " for c in answer.decode("utf-8", "replace")).split())[:120]
    message = f"the answer is {code} {http.client.responses.get(code, '')}".rstrip() + (f" ({words})" if words else "")
    if code in _NOT_TAKEN:
        return PublishError("not-taken", message, "check what the receiver expects", status=code)
    remedy = "check the token" if code in (401, 403) else "check publish.url and the log of the receiver"
    return PublishError("refused", message, remedy, status=code)
