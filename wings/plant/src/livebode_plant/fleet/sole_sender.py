"""SoleSender: stores the messages of an axis as long as no other sender stores messages of the same axis."""

from __future__ import annotations

import asyncio
import logging
import time

from livebode_plant.fleet.log import FleetLog, OtherLastError
from livebode_plant.fleet.message import message_id
from livebode_plant.fleet.subjects import EDGE, axis_path

QUIET_S = 2.0
"""Time without a message of another sender after which this one begins."""
_SENTENCE_S = 60.0
_NO_NUMBER = 1 << 62
"""More than the number of any message: a message that is to follow it is refused, with the number of the last one."""
_logger = logging.getLogger(f"livebode.{__name__}")


class SoleSender:
    """Sends the messages of one axis to the log.

    Each message names the number of the message that it follows, and the log refuses it if another one is there: an
    edge that was copied with its configuration cannot mix its samples into those of the original. A sender begins when
    nothing has been stored for `QUIET_S`, so that one that is started again continues at once, whatever became of its
    connection before, while a second one waits until the first has ended.

    Parameters
    ----------
    log
        The connection.
    key
        Of the axis.
    """

    def __init__(self, log: FleetLog, key: str) -> None:
        self._log, self._key, self._subject = log, key, f"{EDGE}.{key}"
        self._last: int | None = None
        self._reported_s = float("-inf")

    async def send(self, message: bytes) -> None:
        """Store a message; wait while another sender is active."""
        identity = message_id(self._key, message)
        while True:
            if self._last is None:
                self._last = await self._quiet_last()
            try:
                number = await self._log.append(self._subject, message, identity, self._last)
            except OtherLastError as error:
                # A lower number: the log was restored, or has deleted the messages of this axis. Without an answer to
                # an attempt before, the last message may be this one.
                if error.last <= self._last or error.repeated:
                    self._last = error.last
                else:
                    self._report()
                    self._last = None
            else:
                self._last = max(self._last, number)  # a repeat has the number that it got before
                return

    async def _quiet_last(self) -> int:
        """Number of the last message of the axis, when no other sender has stored one for some time."""
        last = await self._number_of_last()
        while last:
            await asyncio.sleep(QUIET_S)
            before, last = last, await self._number_of_last()
            if last == before:
                break
            self._report()
        return last

    async def _number_of_last(self) -> int:
        try:
            await self._log.append(self._subject, b"", after=_NO_NUMBER)
        except OtherLastError as error:
            return error.last
        raise AssertionError("the server has stored a message after a number that does not exist")

    def _report(self) -> None:
        if time.monotonic() - self._reported_s >= _SENTENCE_S:
            self._reported_s = time.monotonic()
            _logger.warning(
                "another sender stores messages of %s: this one waits, and its messages remain in its buffer; end one "
                "of them, or give it another [machine]",
                axis_path(self._key),
            )
