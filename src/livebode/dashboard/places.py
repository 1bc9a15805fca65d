"""Places: which browsers are served at the same time, and which one is displaced by another."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from livebode.dashboard.access import Role, network
from livebode.dataclass import dataclass

PLACES = 16
"""Largest number of browsers at the same time."""


@dataclass(frozen=True, eq=False)
class ClientPlace:
    """The place of a browser: its role, its address, and the function that ends it."""

    role: Role
    address: str
    leave: Callable[[], None]


class Places:
    """Assigns places, and displaces browsers with lower priority.

    An operator displaces the oldest viewer. Without tokens all browsers are equal: a new browser displaces the oldest
    one of the address with the most places, so that open web sockets exclude nobody.

    Parameters
    ----------
    open
        Whether no token is required.
    """

    def __init__(self, open: bool) -> None:
        self._open = open
        self._taken: list[ClientPlace] = []

    def __len__(self) -> int:
        return len(self._taken)

    def enter(self, place: ClientPlace) -> bool:
        """Whether there is a place, which `leave` must return; another browser may be displaced."""
        if len(self._taken) >= PLACES:
            oldest = self._displaceable(place)
            if oldest is None:
                return False
            self.leave(oldest)
            oldest.leave()
        self._taken.append(place)
        return True

    def leave(self, place: ClientPlace) -> None:
        """Return a place."""
        if place in self._taken:
            self._taken.remove(place)

    def displace_all(self) -> None:
        """End all browsers: what they show is gone."""
        for place in list(self._taken):
            self.leave(place)
            place.leave()

    def _displaceable(self, newcomer: ClientPlace) -> ClientPlace | None:
        if not self._open:
            viewers = [place for place in self._taken if place.role == "viewer"]
            return viewers[0] if viewers and newcomer.role == "operator" else None
        addresses = [network(place.address) for place in self._taken]
        crowded = Counter(addresses).most_common(1)[0][0]
        return self._taken[addresses.index(crowded)]
