"""A process that sends the messages of many axes to the log in real time, and counts what the log confirms."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass
from typing import Any

from bench.fleet_loads import AxisLoad
from livebode_plant.fleet.subjects import EDGE

_STEP_S, _CONFIRMED_S = 0.01, 60.0


@dataclass(frozen=True)
class Generated:
    """What was sent.

    Attributes
    ----------
    began_s
        Seconds since 1970 at the first sample of the first axis; the others begin later, evenly within a period.
    spent_s
        Processor time of sending; the messages were encoded before.
    """

    began_s: float
    period_s: float
    axes: int
    messages: int
    confirmed: int
    data_bytes: int
    spent_s: float

    def due_s(self, axis: int, number: int) -> float:
        """When the newest sample of a message was sampled."""
        return self.began_s + self.period_s * (number + 1 + axis / self.axes)


def generate(url: str, load: AxisLoad, keys: list[str], seconds: float, go: Any, answers: Any) -> None:
    """Encode all messages, report "ready", wait for `go`, send, and report what was `Generated`.

    Unlike an edge, it does not wait for the confirmation of a message before the next one of the same axis.
    """
    each = round(seconds / load.period_s)
    messages = [[load.message(axis, number) for axis in range(len(keys))] for number in range(each)]
    answers.put("ready")
    go.wait()
    answers.put(asyncio.run(_send(url, load, keys, messages)))


async def _send(url: str, load: AxisLoad, keys: list[str], messages: list[list[bytes]]) -> Generated:
    import nats

    confirmed = 0

    async def count(_: object) -> None:
        nonlocal confirmed
        confirmed += 1

    connection = await nats.connect(url)
    inbox = connection.new_inbox()
    await connection.subscribe(inbox, cb=count)
    began_s, spent_s = time.time(), time.process_time()
    sent = Generated(
        began_s=began_s,
        period_s=load.period_s,
        axes=len(keys),
        messages=sum(map(len, messages)),
        confirmed=0,
        data_bytes=sum(len(one) for row in messages for one in row),
        spent_s=0.0,
    )
    for number, row in enumerate(messages):
        for axis, (key, message) in enumerate(zip(keys, row)):
            while (rest_s := sent.due_s(axis, number) - time.time()) > 0:
                await asyncio.sleep(max(rest_s, _STEP_S))
            identity = {"Nats-Msg-Id": f"{key}:{axis + 1}:{number * load.samples}"}
            await connection.publish(f"{EDGE}.{key}", message, reply=inbox, headers=identity)
    until = time.time() + _CONFIRMED_S
    while confirmed < sent.messages and time.time() < until:
        await asyncio.sleep(_STEP_S)
    spent_s = time.process_time() - spent_s
    await connection.close()
    return Generated(**vars(sent) | {"confirmed": confirmed, "spent_s": spent_s})
