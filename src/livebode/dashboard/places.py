"""Places: which browsers are served at once, and which one makes room for another."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from livebode.dashboard.access import Role, network

PLACES = 16
"""Browsers at once."""


@dataclass(frozen=True, eq=False)
class Place:
    """One browser's: what it may do, where it comes from, and what ends it."""

    role: Role
    address: str
    leave: Callable[[], None]


class Places:
    """Gives places, and takes them from those who have less right to one.

    An operator's token displaces the oldest viewer. Where no token is asked for, nobody can show that the page is
    theirs: a new browser displaces the oldest one of the address that holds the most places, so that held web sockets
    shut out nobody.

    Parameters
    ----------
    open
        Whether no token is asked for.
    """

    def __init__(self, open: bool) -> None:
        self._open = open
        self._taken: list[Place] = []

    def __len__(self) -> int:
        return len(self._taken)

    def take(self, place: Place) -> bool:
        """Whether there is a place, which is to be given back by `leave`; another browser may be asked to go."""
        if len(self._taken) >= PLACES:
            oldest = self._displaceable(place)
            if oldest is None:
                return False
            self.leave(oldest)
            oldest.leave()
        self._taken.append(place)
        return True

    def leave(self, place: Place) -> None:
        """Give a place back."""
        if place in self._taken:
            self._taken.remove(place)

    def _displaceable(self, newcomer: Place) -> Place | None:
        if not self._open:
            viewers = [place for place in self._taken if place.role == "viewer"]
            return viewers[0] if viewers and newcomer.role == "operator" else None
        addresses = [network(place.address) for place in self._taken]
        crowded = Counter(addresses).most_common(1)[0][0]
        return self._taken[addresses.index(crowded)]
