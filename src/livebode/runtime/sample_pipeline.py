"""SamplePipeline: what a run needs of the processing of its samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from livebode.configuration.axis import Axis
from livebode.core import Lines, Stateful


class SamplePipeline(Protocol):
    """Processing of the samples of an axis, as far as a run depends on it."""

    @property
    def axis(self) -> Axis | None: ...

    @property
    def lines(self) -> Lines: ...

    @property
    def step(self) -> int:
        """Samples between responses."""

    @property
    def signals(self) -> list[str]:
        """Channels that are correlated."""

    @property
    def reference(self) -> str:
        """The channel whose power is that of the excitation."""

    @property
    def channels(self) -> list[str]:
        """All channels in use, each once."""

    @property
    def parts(self) -> Mapping[str, Stateful]:
        """Stages with a state, by name."""

    @property
    def counts(self) -> dict[str, int]:
        """Those of the tracker."""

    def take_over(self, before: SamplePipeline) -> bool:
        """Continue with the state of the previous one, if possible; whether its tracker continues."""
