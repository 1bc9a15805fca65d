"""Feeds: where the status messages of a fleet come from, and where acts of persons go; one of them is simulated."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterable
from typing import Any, Protocol

import numpy as np

from livebode.core import FleetError
from livebode_plant.fleet.connection import connected
from livebode_plant.fleet.fleet_settings import LogSection
from livebode_plant.fleet.status_message import (
    ACTIVE,
    AXIS_STATUS,
    BEHIND,
    GAPS,
    NAMES,
    NOT_READY,
    SILENT,
    VIEW,
    AxisName,
    PartitionNames,
    encode_names,
    encode_status,
)
from livebode_plant.fleet.subjects import ACTS, ACTS_STREAM, VIEW_API, axis_token
from livebode_plant.page.fleet_board import FleetAct

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
                message = await js.get_msg(ACTS_STREAM, number, subject=f"{ACTS}.>", next=True)
                hear_act(message.data or b"")
                number, pause_s = message.seq + 1, 0.0
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


KINDS = ("", "change", "gap", "disconnected", "backlog")
_SITES = ("Augsburg", "Brno", "Chengdu", "Detroit", "Eskilstuna", "Faenza")
_LINES, _MACHINES = ("body", "paint", "assembly", "packaging", "press"), ("gantry", "robot", "press", "spindle", "belt")
_LETTERS = ("x", "y", "z", "a", "b", "c")
PARTITION_AXES = 250
_STIFFNESS, _BOUND_PERCENT = 1.35e6, 0.3
ALARM_PERCENT, CHECK_PERCENT = -5.0, -2.5


def demo_paths(axes: int) -> list[str]:
    """Paths of simulated axes: six axes a machine, some ten machines a line."""
    machines = -(-axes // len(_LETTERS))
    lines = max(1, min(len(_LINES) * len(_SITES), machines // 8))
    paths = []
    for machine in range(machines):
        line = machine % lines
        site, name = _SITES[line % len(_SITES)], _LINES[line // len(_SITES) % len(_LINES)]
        kind = _MACHINES[machine // lines % len(_MACHINES)]
        paths += [f"{site}/{name}/{kind} {machine // lines + 1}/{letter}" for letter in _LETTERS]
    return paths[:axes]


class DemoFleet:
    """The truth of a simulated fleet, to try the page without machines: axes that age, fall silent and lose samples.

    Arrays have one value for each axis, in the order of `paths`. Everything follows from the seed and the time since
    the start, so that a test knows the truth.

    Parameters
    ----------
    axes
        How many.
    seed
        Of what happens to which axis.
    """

    def __init__(self, axes: int, seed: int = 1) -> None:
        rng = np.random.default_rng(seed)
        self.paths = demo_paths(axes)
        count = len(self.paths)
        self._fate = rng.random(count)
        self._value = _STIFFNESS * rng.uniform(0.5, 2.0, count)
        self._change = rng.normal(0.0, 0.4, count)
        self._wave = rng.uniform(0, 2 * np.pi, count)
        self.partitions = -(-count // PARTITION_AXES)
        self.workers = max(2, -(-self.partitions // 8))
        self._status = np.zeros(count, AXIS_STATUS)
        self._status["axis"] = np.arange(count) % PARTITION_AXES
        self._fell_s = rng.uniform(5.0, 120.0, count)
        self._extra: dict[int, float] = {}

    def alarm(self, axis: int, since_s: float) -> None:
        """Let an axis lose its stiffness from this time since the start on."""
        self._extra[axis] = since_s

    def status(self, after_s: float, now_s: float) -> np.ndarray:
        """`AXIS_STATUS` of all axes some seconds after the start; `now_s` is that moment in seconds since 1970."""
        found, fate = self._status.copy(), self._fate
        change = self._change + 0.15 * np.sin(after_s / 7 + self._wave)
        soft = (fate < 0.004) & (after_s > self._fell_s)
        soft[[axis for axis, since_s in self._extra.items() if after_s > since_s]] = True
        change[soft] -= 8.0
        drifting = (fate >= 0.004) & (fate < 0.024)
        change[drifting] -= 3.3
        found["change_percent"], found["value"] = change, self._value * (1 + change / 100)
        found["bound"] = self._value * _BOUND_PERCENT / 100
        found["lag_s"] = 0.28 + 0.1 * np.sin(after_s + self._wave)
        found["state"] = np.where(change < ALARM_PERCENT, 3, np.where(change < CHECK_PERCENT, 2, 1))
        silent = (fate >= 0.024) & (fate < 0.03)
        not_ready = (fate >= 0.03) & (fate < 0.05)
        behind = (fate >= 0.05) & (fate < 0.053)
        gaps = (fate >= 0.053) & (fate < 0.06)
        found["state"][not_ready | (fate >= 0.995)] = 0
        for which, flag in ((soft, ACTIVE), (silent, SILENT), (not_ready, NOT_READY), (behind, BEHIND), (gaps, GAPS)):
            found["flags"][which] |= flag
        found["lag_s"][behind] += 4.0
        found["lag_s"][silent] = after_s + 30
        over = gaps & (fate < 0.0535)
        found["raised"] = soft | gaps
        found["kind"] = np.where(soft, 1, np.where(gaps, 2, 0))
        found["priority"] = np.where(soft, 3, np.where(over, 2, np.where(gaps, 1, 0)))
        found["raised"][gaps & ~over] = 0
        began_s = now_s - after_s
        found["raised_s"] = np.where(found["raised"] > 0, began_s + np.where(soft, self._fell_s, 1.0), 0)
        found["gaps"][gaps] = 1 + (after_s / 20 * fate[gaps] / 0.06).astype(int)
        found["lost"][gaps] = found["gaps"][gaps] * (100 + (1e6 * fate[gaps]).astype(int) % 900)
        found["effective_s"] = now_s - found["lag_s"]
        found["value"][not_ready | (fate >= 0.995)] = np.nan
        return found

    def names(self) -> list[PartitionNames]:
        """The names of each partition."""
        axes = [AxisName(path, "stiffness", "N/m") for path in self.paths]
        return [
            PartitionNames(number, f"worker-{number % self.workers + 1}", tuple(axes[self.part(number)]), KINDS)
            for number in range(self.partitions)
        ]

    def part(self, partition: int) -> slice:
        """The axes of a partition."""
        return slice(partition * PARTITION_AXES, (partition + 1) * PARTITION_AXES)


class DemoFeed:
    """Sends the status of a simulated fleet once a second.

    Parameters
    ----------
    fleet
        The truth.
    silent
        Partitions whose worker has died, from the start.
    began_s
        When the simulation started, seconds since 1970; now by default.
    """

    def __init__(self, fleet: DemoFleet, silent: Iterable[int] = (), began_s: float | None = None) -> None:
        self.fleet, self.name, self.trouble, self.may_act = fleet, "demo", "", True
        self._silent = set(silent)
        self._hear_act: Hear = lambda _: None
        self.began_s = time.time() if began_s is None else began_s

    async def run(self, hear: Hear, hear_act: Hear) -> None:
        """Send until it is cancelled."""
        self._hear_act = hear_act
        tables = {}
        for names in self.fleet.names():
            message, tables[names.partition] = encode_names(names, time.time())
            hear(message)
        while True:
            for message in self.messages(tables, time.time()):
                hear(message)
            await asyncio.sleep(1.0)

    def messages(self, tables: dict[int, int], now_s: float) -> list[bytes]:
        """The status of each partition at this moment."""
        status = self.fleet.status(now_s - self.began_s, now_s)
        messages = []
        for partition, table in tables.items():
            axes = status[self.fleet.part(partition)]
            lag_s = float(np.max(axes["lag_s"][(axes["flags"] & SILENT) == 0], initial=0.0))
            if partition not in self._silent:
                messages.append(encode_status(partition, table, axes, now_s, waiting=int(40 * lag_s), lag_s=lag_s))
        return messages

    async def publish(self, act: FleetAct) -> None:
        """Send it back."""
        self._hear_act(act.to_bytes())
