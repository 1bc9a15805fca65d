"""What an MQTT broker stores while nobody records is recorded whole, whatever ends the processes that record it."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.sources.live import encode_layout, encode_line, encode_samples
from tests.support.command import RATE_HZ
from tests.support.killed_live import check_exact, kill, recorded, start, stop
from tests.support.live_feeds import EPOCH, MqttFeed, batch
from tests.support.peers.broker import TOPIC
from tests.support.peers.machine import CHANNELS
from tests.support.peers.peer import until

SIZE = 500
STORED_S = 75
"""More than may wait in any queue."""
KILLS = int(os.environ.get("LIVEBODE_CRASH_KILLS_EACH", "3"))


class Backlog(MqttFeed):
    """Sends as fast as the broker takes it, and only when it is asked to; `numbered`: with an epoch.

    `frames`: as binary frames, which cannot be read without the layout that is sent once, before the first one.
    """

    def __init__(self, folder: Path, *, epoch: int, frames: bool, broker: tuple[str, ...] = ()) -> None:
        super().__init__(folder, *broker)
        self._epoch, self._frames = epoch, frames

    def __enter__(self) -> Backlog:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def layout(self) -> None:
        self._publish(encode_layout(CHANNELS, float(RATE_HZ), epoch=self._epoch))

    def more(self, seconds: float, size: int = SIZE) -> None:
        """The broker has so many seconds more."""
        for first in range(self.sent, self.sent + round(seconds * RATE_HZ), size):
            one = batch(first, size, self._epoch)
            self._publish(encode_samples(one, double=True) if self._frames else encode_line(one))
            self.sent = one.stop

    def _publish(self, payload: bytes) -> None:
        self._publisher.publish(TOPIC, payload, qos=1).wait_for_publish(30)


@contextmanager
def begun(folder: Path, **how: Any) -> Iterator[tuple[Backlog, Path]]:
    """A run that was begun, and ended in the usual way; its first samples are those from before."""
    with Backlog(folder, **how) as feed:
        run = folder / "run"
        process = start(feed, run)
        feed.wait_subscribed()
        feed.layout()
        feed.more(10, 20)
        until(lambda: recorded(run, "n")[1].size > RATE_HZ, "a second in the record")
        stop(process)
        yield feed, run


def check_whole(feed: Backlog, run: Path) -> None:
    feed.more(1)  # the last process may have recorded all, and one that receives nothing ends with an error
    process = start(feed, run)
    while (last := recorded(run, "n")[1][-1]) < feed.sent - 1:
        until(lambda last=last: recorded(run, "n")[1][-1] > last, "more to be recorded")
    stop(process)
    check_exact(run, "n", whole=True)
    assert recorded(run, "n")[1][0] == feed.first


@pytest.mark.parametrize(("epoch", "frames"), [(EPOCH, False), (0, True)])
def test_a_backlog_longer_than_any_queue_is_recorded_whole(tmp_path: Path, epoch: int, frames: bool) -> None:
    with begun(tmp_path, epoch=epoch, frames=frames) as (feed, run):
        feed.more(STORED_S)
        check_whole(feed, run)


@pytest.mark.parametrize(("epoch", "frames"), [(EPOCH, True), (0, False)])
def test_kills_with_a_backlog_cost_nothing(tmp_path: Path, epoch: int, frames: bool) -> None:
    rng = np.random.default_rng(epoch)
    with begun(tmp_path, epoch=epoch, frames=frames) as (feed, run):
        for _ in range(KILLS):
            feed.more(5, 50)
            before = recorded(run, "n")[1].size
            process = start(feed, run)
            until(lambda before=before: recorded(run, "n")[1].size > before, "the first commit of the process")
            time.sleep(rng.uniform(0, 0.5))
            kill(process)
        check_whole(feed, run)
    print(f"MQTT with a backlog: {KILLS} kills; nothing lost, nothing twice")
