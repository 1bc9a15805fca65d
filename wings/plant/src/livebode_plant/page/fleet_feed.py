"""Feeds: where the status messages of a fleet come from, and where acts of persons go."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from typing import Any, Protocol

from livebode.core import FleetError
from livebode_plant.fleet.connection import connected
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.page_status import NAMES, VIEW
from livebode_plant.fleet.subjects import ACTS, ACTS_STREAM, VIEW_API, axis_token
from livebode_plant.page.fleet_alarms import FleetAct

_POLL_S = 1.0
"""Between two requests of a viewer for new acts."""
Hear = Callable[[bytes], None]


class StatusFeed(Protocol):
    """Delivers messages until it is cancelled.

    Attributes
    ----------
    name
        Of the fleet, for the title of the page.
    trouble
        Why no messages can arrive at the moment; empty while they can.
    may_act
        Whether acts can be stored: not with the key of a viewer.
    """

    name: str
    trouble: str
    may_act: bool

    async def run(self, hear: Hear, hear_act: Hear) -> None:
        """Pass each status message to `hear` and each act to `hear_act`, those from before first."""

    async def publish(self, act: FleetAct) -> None:
        """Store an act and send it to all pages of the fleet, to this one too; FleetError if that is impossible."""


class NatsFeed:
    """The messages of a fleet's log.

    Parameters
    ----------
    log
        The server, and the key; with that of a viewer no acts can be stored.
    name
        Of the fleet.
    """

    def __init__(self, log: LogSection, name: str) -> None:
        self._log, self.name, self.may_act = log, name, log.access != "view"
        self.trouble = ""
        self._connection: Any = None

    async def connect(self) -> None:
        """Connect.

        Raises
        ------
        ConfigError, FleetError, ExtraError
            As `connected`.
        """
        self._connection = await connected(
            self._log,
            "livebode fleet status",
            self._note,
            disconnected_cb=self._lost,
            reconnected_cb=self._back,
        )
        from nats.errors import Error

        self._errors, self.trouble = Error, ""

    async def close(self) -> None:
        """Disconnect."""
        if self._connection is not None:
            with contextlib.suppress(self._errors, TimeoutError):
                await self._connection.close()

    async def run(self, hear: Hear, hear_act: Hear) -> None:
        """Subscribe, and deliver until it is cancelled."""
        if self._connection is None:
            await self.connect()

        async def status(message: Any) -> None:
            hear(message.data)

        for subject in (VIEW, NAMES):
            await self._connection.subscribe(f"{subject}.*", cb=status)
        try:
            await (self._follow_acts(hear_act) if self.may_act else self._ask_for_acts(hear_act))
        finally:
            await self.close()

    async def _follow_acts(self, hear_act: Hear) -> None:
        """Receive the acts that are stored and all later ones."""
        from nats.js import api

        async def act(message: Any) -> None:
            hear_act(message.data)

        js, reported = self._connection.jetstream(), ""
        while True:
            with contextlib.suppress(self._errors):  # it exists
                await js.add_stream(
                    name=ACTS_STREAM, subjects=[f"{ACTS}.>"], max_msgs_per_subject=1, storage=api.StorageType.FILE
                )
            try:
                await js.subscribe(f"{ACTS}.>", cb=act, ordered_consumer=True)
            except self._errors as error:
                reported = self._acts_unread(error)
                await asyncio.sleep(_POLL_S)
            else:
                break
        self._acts_read(reported)
        await asyncio.Event().wait()

    async def _ask_for_acts(self, hear_act: Hear) -> None:
        """Receive acts with the key of a viewer, which has no consumer: ask for the next one, again and again.

        nats-server 2.9.10 can end at the request for the next message of a stream that is being created, so it is asked
        first whether there is one.
        """
        from nats.js.errors import NotFoundError

        js, number, reported = self._connection.jetstream(prefix=VIEW_API), 1, ""
        while True:
            try:
                if (await js.stream_info(ACTS_STREAM)).state.last_seq < number:
                    raise NotFoundError
                found = await js.get_msg(ACTS_STREAM, number, subject=f"{ACTS}.>", next=True)
                hear_act(found.data or b"")
                number, pause_s = found.seq + 1, 0.0
            except NotFoundError:  # none yet
                pause_s = _POLL_S
            except (TimeoutError, self._errors) as error:
                reported, pause_s = self._acts_unread(error), _POLL_S
            else:
                self._acts_read(reported)
            await asyncio.sleep(pause_s)

    def _acts_unread(self, error: Exception) -> str:
        """Report it where there is no other trouble; returns the sentence."""
        reported = f"acknowledgements cannot be read: {error or type(error).__name__}"
        self.trouble = self.trouble or reported
        return reported

    def _acts_read(self, reported: str) -> None:
        """Take back what was reported; another trouble remains."""
        self.trouble = "" if self.trouble == reported else self.trouble

    async def publish(self, act: FleetAct) -> None:
        """Store an act in the log."""
        if not self.may_act:
            raise FleetError(
                "view-only",
                "this page was opened with the key of a viewer, which stores nothing in the log",
                "open it with a key of users.fleet, and without log.access",
            )
        levels = ".".join(map(axis_token, act.path.split("/")))
        kind = "acknowledge" if act.act == "acknowledge" else "shelf"
        try:
            await self._connection.jetstream().publish(f"{ACTS}.{kind}.{levels}", act.to_bytes(), timeout=2.0)
        except (TimeoutError, self._errors) as error:
            raise FleetError(
                "log-unreachable",
                f"the log did not store it ({error or type(error).__name__})",
                "try again when the log can be reached",
                url=self._log.url,
            ) from None

    def _note(self, error: Exception) -> None:
        self.trouble = self.trouble or str(error) or type(error).__name__

    async def _lost(self) -> None:
        self.trouble = "no connection to the log"

    async def _back(self) -> None:
        self.trouble = ""
