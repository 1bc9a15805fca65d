"""Calls on the file system of which one fails, or is the last one before the power goes."""

from __future__ import annotations

import errno
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

CALLS = ("open", "write", "fdatasync", "fsync", "ftruncate", "replace", "unlink", "mkdir")


class PowerCut(BaseException):
    """Nothing is done after it."""


class Disk:
    """Counts the calls that change files, and lets the `at`-th one go wrong in a given way."""

    def __init__(self, at: int, wrong: Callable[[Disk], None]) -> None:
        self.at, self.wrong, self.count, self.dead = at, wrong, 0, False
        self.counting = threading.Lock()

    def around(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def called(*args: Any, **kwargs: Any) -> Any:
            if self.dead:
                raise PowerCut
            with self.counting:
                self.count += 1
                mine = self.count == self.at
            if mine:
                if name == "write":  # half of it reaches the disk
                    call(args[0], memoryview(args[1])[: len(args[1]) // 2])
                self.wrong(self)
            return call(*args, **kwargs)

        return called


def full(_: Disk) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def cut(disk: Disk) -> None:
    disk.dead = True
    raise PowerCut


@contextmanager
def disk_that(wrong: Callable[[Disk], None], at: int) -> Iterator[Disk]:
    disk = Disk(at, wrong)
    with pytest.MonkeyPatch.context() as patch:
        for name in CALLS:
            patch.setattr(os, name, disk.around(name, getattr(os, name)))
        yield disk
