"""Turns: one thread does the steps of all axes of a process, in the order in which these have something to do.

Python runs one thread at a time, and another one takes over wherever a function in C lets go of the interpreter: many
times in a Block. Threads of axes that compute at once are therefore all late, and waking a thread for each Block costs
as much as the Block. So the thread of one axis leads: it does the steps of all axes, and the threads of the others
wait. Between the steps it receives the datagrams, for which it would otherwise wait. The batches that arrive while an
axis waits for its turn are one Block. A step that other axes can have a part in ends where that part is due; it is
computed for all axes whose turn it is, and each continues with its own result. `python -m bench.hall` measures it.
"""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from contextvars import copy_context
from math import inf

from livebode.core import Responses
from livebode.runtime.joining import Steps, WaitingSpectra, track_together
from livebode.sources.live import receiver

TICK_S = 0.1
"""An axis without samples has a step in this interval."""
TURN_S = 0.01
"""An axis whose next step is due at once does it, until it had the turn for so long: its state is in the cache."""
RECEIVE_S = 0.002
"""Interval in which the thread that leads receives datagrams while steps are due."""
STEP_S_MAX = 1.0
"""Longest step that others wait for: an axis that does not return, as on a network drive, delays them but does not stop
them."""


class Turn:
    """The steps of one axis, each of which says whether the next one is due at once, or only when samples come; or it
    names the spectra whose responses it continues with, or with None to compute them itself.

    Parameters
    ----------
    steps
        They are done in any thread, but in the context in which this was created.
    """

    def __init__(self, steps: Steps) -> None:
        self._steps, self._context = steps, copy_context()
        self.ended = False
        self.spectra: WaitingSpectra | None = None
        """Those with whose `responses` the step continues."""
        self.responses: Responses | None = None
        self.error: BaseException | None = None
        """What the last step raised."""
        self.waits = self.works = self.asked_again = False
        self.stepped_s = -inf
        self.called = threading.Event()
        """Its thread leads from now, or the last step was done."""

    def ask(self) -> None:
        """A step is due. Any thread may call it, at any time."""
        _lines[0].ask(self)

    def run(self) -> None:
        """Do the steps until the last one, and those of others; raises what a step raised."""
        _lines[0].run(self)

    def step(self) -> bool:
        """Do one, or continue it with the responses; whether the next one is due. With spectra it is not complete."""
        responses, self.responses, self.spectra = self.responses, None, None
        try:
            found = self._context.run(self._steps.send, responses)
        except StopIteration:
            self.ended = True
            return False
        except BaseException as error:  # it belongs to the thread of this axis
            self.ended, self.error = True, error
            return False
        if isinstance(found, bool):
            return found
        self.spectra = found
        return False


class _Line:
    """The turns of a process, and which of their threads leads."""

    def __init__(self) -> None:
        self._changed = threading.Lock()
        self._all: dict[Turn, None] = {}
        self._asked: deque[Turn] = deque()
        self._joined: list[Turn] = []  # their steps end at spectra, which wait to be tracked together
        self._leader: Turn | None = None
        self._since_s = inf  # when the leader began a step
        self._ticked_s = self._received_s = -inf
        self._waits = False  # the leader, for datagrams or a step
        self._waiting = 0  # its thread

    def ask(self, turn: Turn) -> None:
        with self._changed:
            # The leader that receives what an axis waits for looks for it next, without being woken.
            wakes = self._append(turn) and self._waits and threading.get_ident() != self._waiting
            self._waits &= not wakes
        if wakes:
            receiver().wake()

    def _append(self, turn: Turn) -> bool:
        """Whether it waits from now."""
        turn.asked_again |= turn.works
        new = not (turn.waits or turn.works or turn.ended)
        if new:
            turn.waits = True
            self._asked.append(turn)
        return new

    def run(self, turn: Turn) -> None:
        with self._changed:
            self._all[turn] = None
        self.ask(turn)
        try:
            while not turn.ended:
                if self._leads(turn):
                    self._work(turn)
                elif not turn.called.wait(STEP_S_MAX):
                    self._replace_leader()
        finally:
            self._leave(turn)
        if turn.error is not None:
            raise turn.error

    def _leads(self, turn: Turn) -> bool:
        with self._changed:
            turn.called.clear()
            if self._leader is None and not turn.ended:
                self._leader = turn
            return self._leader is turn

    def _replace_leader(self) -> None:
        """Another thread may lead if a step takes too long; that one still does the step."""
        with self._changed:
            if time.monotonic() - self._since_s >= STEP_S_MAX:
                self._leader, self._since_s = None, inf

    def _leave(self, turn: Turn) -> None:
        """The thread of another axis leads, if this one did."""
        with self._changed:
            del self._all[turn]
            turn.ended = True
            if self._leader in (turn, None):
                self._leader = None
                for other in self._all:
                    if not other.ended:
                        other.called.set()
                        break

    def _work(self, turn: Turn) -> None:
        """Do steps of all axes, until this one ended or another thread leads."""
        while not turn.ended and (one := self._next(turn)) is not None:
            due, until_s = one.step(), one.stepped_s + TURN_S
            while (due and time.monotonic() < until_s) or (one.spectra is not None and self._is_alone):
                due = one.step()
            with self._changed:
                if one.spectra is not None:
                    self._joined.append(one)
                    continue
                one.works = False
                if one.ended:
                    one.called.set()
                elif due or one.asked_again:
                    self._append(one)

    @property
    def _is_alone(self) -> bool:
        """Whether no other axis waits, with which one could be joined."""
        return not (self._asked or self._joined)

    def _track_together(self) -> None:
        """Compute what ended the steps of axes, which are the next ones to continue."""
        with self._changed:
            joined, self._joined = self._joined, []
        found = track_together([one.spectra for one in joined if one.spectra is not None])
        with self._changed:
            for one, responses in zip(joined, found):
                one.responses = responses
            self._asked.extendleft(reversed(joined))

    def _begin(self, now_s: float) -> Turn:
        one = self._asked.popleft()
        one.asked_again &= one.spectra is not None  # a step that continues may have been asked for again
        one.waits, one.works, one.stepped_s = False, True, now_s
        self._since_s = now_s
        return one

    def _next(self, leader: Turn) -> Turn | None:
        """The axis that has waited longest, as soon as there is one; None if this thread does not lead any more, or its
        axis has ended, whose last step a thread that led before may have done.
        """
        while True:
            with self._changed:
                if self._leader is not leader or leader.ended:
                    return None
                now_s = time.monotonic()
                if now_s - self._ticked_s >= TICK_S:
                    self._tick(now_s)
                received = now_s - self._received_s < RECEIVE_S
                if self._asked and received:
                    return self._begin(now_s)
                joins = bool(self._joined)
            if joins:
                self._track_together()
                continue
            with self._changed:
                self._since_s, self._waits, self._waiting = inf, not self._asked, threading.get_ident()
                timeout_s = max(0.0, self._ticked_s + TICK_S - now_s) if self._waits else 0.0
            receiver().receive(timeout_s)
            self._received_s = time.monotonic()
            self._waits = False

    def _tick(self, now_s: float) -> None:
        self._ticked_s = now_s
        for turn in self._all:
            if now_s - turn.stepped_s >= TICK_S:
                self._append(turn)


_lines = [_Line()]
if hasattr(os, "register_at_fork"):  # the threads do not exist in a child

    def _renew() -> None:
        _lines[0] = _Line()

    os.register_at_fork(after_in_child=_renew)
