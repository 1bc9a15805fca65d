"""Access control: tokens, sessions, roles, and a growing delay after wrong tokens."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from http.cookies import CookieError, SimpleCookie
from math import ceil
from typing import Literal

from livebode.core import ServerError
from livebode.dashboard.settings import Serving

Role = Literal["operator", "viewer"]

COOKIE = "livebode"
SESSION_S = 12 * 3600.0
_SESSIONS_MAX = 64
_ADDRESSES_MAX = 1024
_FREE_TRIES = 5
_PAUSE_S_MAX = 300.0


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
        self, serving: Serving, report: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._hashes: list[tuple[Role, bytes]] = []
        if serving.token is not None:
            self._hashes.append(("operator", _hash(serving.token)))
        if serving.viewer_token is not None:
            self._hashes.append(("viewer", _hash(serving.viewer_token)))
        self._read_only, self._report, self._clock = serving.read_only, report, clock
        self._sessions: OrderedDict[bytes, tuple[Role, float]] = OrderedDict()
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
        session = secrets.token_urlsafe(32)
        self._sessions[_hash(session)] = role, self._clock() + SESSION_S
        while len(self._sessions) > _SESSIONS_MAX:
            self._sessions.popitem(last=False)
        return session

    def logout(self, cookie: str) -> None:
        """Remove the session of a Cookie header."""
        self._sessions.pop(_hash(_session(cookie)), None)

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
            return self._check(token.strip() if scheme.lower() == "bearer" else "", address)
        # The lookup uses the hash, so its duration reveals nothing about the secret.
        role, until = self._sessions.get(_hash(_session(cookie)), (None, 0.0))
        return self._limited(role) if role is not None and self._clock() < until else None

    def _check(self, token: str, address: str) -> Role | None:
        address = network(address)
        count, until = self._wrong.get(address, (0, 0.0))
        if (left := until - self._clock()) > 0:
            raise ServerError(
                "too-many-tries", "too many wrong tokens", f"try again in {ceil(left)} s", retry_after_s=ceil(left)
            )
        given, found = _hash(token), None
        for role, known in self._hashes:  # always all of them: the duration must not depend on the match
            if hmac.compare_digest(given, known):
                found = role
        if found is not None:
            self._wrong.pop(address, None)
            return self._limited(found)
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
        found = SimpleCookie(cookie).get(COOKIE)
    except CookieError:
        return ""
    return "" if found is None else found.value


def network(address: str) -> str:
    """The address; for IPv6 its /64 network, which belongs to one customer."""
    try:
        known = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return "?"
    if known.version == 6 and known.ipv4_mapped is None:
        return str(ipaddress.ip_network((known, 64), strict=False))
    return str(known)
