"""Access control: tokens, sessions, roles, and a growing delay after wrong tokens."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import secrets
import time
from collections import Counter, OrderedDict
from collections.abc import Callable
from http.cookies import CookieError, SimpleCookie
from math import ceil
from typing import TYPE_CHECKING, Any, Literal

from livebode.core import ServerError
from livebode.dashboard.server_settings import ServerSettings
from livebode.language import Message, for_page

if TYPE_CHECKING:
    from starlette.requests import HTTPConnection

Role = Literal["operator", "viewer"]

COOKIE = "livebode"
SESSION_S = 12 * 3600.0
_SESSIONS_MAX = 64
_ADDRESSES_MAX = 1024
_FREE_TRIES = 5  # a person mistypes; from here on the pauses double
_PAUSE_S_MAX = 300.0


def error_answer(error: Exception | str) -> dict[str, Any]:
    """What a page gets instead of an answer."""
    words = getattr(error, "words", str(error)) if isinstance(error, Exception) else error
    return {"error": str(words), "words": for_page(words)}


class Access:
    """Checks tokens, stores sessions, and delays clients that send wrong tokens, longer each time.

    Parameters
    ----------
    serving
        Tokens, and whether the dashboard is read-only.
    report
        Called with a message once for each address that sends a wrong token.
    clock
        Monotonic time in seconds.
    """

    def __init__(
        self, serving: ServerSettings, report: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._hashes: list[tuple[Role, bytes]] = []
        if serving.token is not None:
            self._hashes.append(("operator", _hash(serving.token)))
        if serving.viewer_token is not None:
            self._hashes.append(("viewer", _hash(serving.viewer_token)))
        self._read_only, self._report, self._clock = serving.read_only, report, clock
        self._sessions: dict[Role, dict[bytes, tuple[str, float]]] = {"operator": {}, "viewer": {}}
        self._wrong: OrderedDict[str, tuple[int, float]] = OrderedDict()
        self._reported: OrderedDict[str, None] = OrderedDict()
        self.refused = 0

    @property
    def open(self) -> bool:
        """Whether no token is required."""
        return not self._hashes

    def login(self, token: str, address: str) -> str | None:
        """The secret of a new session for a correct token, None for a wrong one.

        Raises
        ------
        ServerError
            If this address must wait.
        """
        role = self._check(token, address)
        if role is None:
            return None
        session, sessions = secrets.token_urlsafe(32), self._sessions[role]
        if len(sessions) >= _SESSIONS_MAX:
            self._displace(sessions)
        sessions[_hash(session)] = network(address), self._clock() + SESSION_S
        return session

    def logout(self, cookie: str) -> None:
        """Remove the session of a Cookie header."""
        for sessions in self._sessions.values():
            sessions.pop(_hash(_session(cookie)), None)

    def role(self, cookie: str, authorization: str, address: str) -> Role | None:
        """The role of a client from the headers Cookie and Authorization; None without access.

        Raises
        ------
        ServerError
            If this address sent wrong tokens and must wait.
        """
        if self.open:
            return self._limited("operator")
        if authorization:
            scheme, _, token = authorization.partition(" ")
            role = self._check(token.strip() if scheme.lower() == "bearer" else "", address)
            return None if role is None else self._limited(role)
        # The lookup uses the hash, so its duration reveals nothing about the secret.
        session = _hash(_session(cookie))
        for role, sessions in self._sessions.items():
            if session in sessions and self._clock() < sessions[session][1]:
                return self._limited(role)
        return None

    def role_of(self, connection: HTTPConnection) -> Role | None:
        """The role of who sent a request or opened a web socket; None without access, ServerError as above."""
        headers, client = connection.headers, connection.client
        return self.role(headers.get("cookie", ""), headers.get("authorization", ""), client.host if client else "")

    def _displace(self, sessions: dict[bytes, tuple[str, float]]) -> None:
        """Remove those that are over, else the oldest one of the address with the most.

        So a program that logs in again and again ends its own sessions, not that of a person at another address.
        """
        now_s = self._clock()
        over = [session for session, (_, until_s) in sessions.items() if until_s <= now_s]
        counts = Counter(address for address, _ in sessions.values())
        (most, _), *_ = counts.most_common(1)
        for session in over or [next(key for key, (address, _) in sessions.items() if address == most)]:
            del sessions[session]

    def _check(self, token: str, address: str) -> Role | None:
        address = network(address)
        count, until = self._wrong.get(address, (0, 0.0))
        if (left := until - self._clock()) > 0:
            raise ServerError(
                "too-many-tries",
                Message("too many wrong tokens"),
                Message("try again in {seconds} s", seconds=ceil(left)),
                retry_after_s=ceil(left),
            )
        given, matching = _hash(token), None
        for role, known in self._hashes:  # always all of them: the duration must not depend on the match
            if hmac.compare_digest(given, known):
                matching = role
        if matching is not None:
            self._wrong.pop(address, None)
            return matching
        self.refused += 1
        pause = 0.0 if count + 1 < _FREE_TRIES else min(2.0 ** (count + 1 - _FREE_TRIES), _PAUSE_S_MAX)
        self._wrong[address] = count + 1, self._clock() + pause
        self._wrong.move_to_end(address)
        if len(self._wrong) > _ADDRESSES_MAX:
            self._wrong.popitem(last=False)
        self._report_once(address)
        return None

    def _report_once(self, address: str) -> None:
        if address not in self._reported:
            self._report(f"the dashboard rejected a wrong token from {address}")
            self._reported[address] = None
            if len(self._reported) > _ADDRESSES_MAX:
                self._reported.popitem(last=False)

    def _limited(self, role: Role) -> Role:
        return "viewer" if self._read_only else role


def _hash(text: str) -> bytes:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).digest()


def _session(cookie: str) -> str:
    try:
        morsel = SimpleCookie(cookie).get(COOKIE)
    except CookieError:
        return ""
    return "" if morsel is None else morsel.value


def network(address: str) -> str:
    """The address; for IPv6 its /64 network, which belongs to one customer."""
    try:
        known = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return "?"
    if known.version == 6 and known.ipv4_mapped is None:
        return str(ipaddress.ip_network((known, 64), strict=False))
    return str(known)
