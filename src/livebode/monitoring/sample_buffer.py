"""SampleBuffer: the samples of some channels that are not used yet."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, StatefulBase


class SampleBuffer(StatefulBase):
    """Base class of what cuts Blocks into pieces of other lengths; the state contains the samples in `_parts`."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names
        self._parts: list[Floats] = []

    def _rows(self, block: Block) -> Floats:
        """The channels of a Block, (channels, samples); LivebodeError where one is missing."""
        return block.data[[block.index(name) for name in self._names]]

    def _state(self) -> dict[str, Any]:
        data = np.concatenate(self._parts, axis=1) if self._parts else np.zeros((len(self._names), 0))
        return super()._state() | {"data": data}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        self._parts = [state["data"]] if state["data"].size else []
