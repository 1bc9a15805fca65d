"""Player: what plays an excitation on a controller. That of a kind of source is in the table of the kinds."""

from __future__ import annotations

from abc import ABC, abstractmethod

from livebode.core import ConfigError, MeasurementError
from livebode.experiment_design import Waveform
from livebode.experiments.measure_section import MeasureSection
from livebode.plugins import loaded, named
from livebode.sources.live import LiveSource, SourceSettings, make_source


class Player(ABC):
    """Plays an excitation on the controller whose samples `source` receives.

    Whatever happens to livebode, the excitation ends: within `stop_s` after it was requested, and by itself if this
    process is killed.
    """

    source: LiveSource
    stop_s: float
    """Longest time from a request until the excitation is zero, in seconds."""

    @abstractmethod
    def __init__(self, source: LiveSource, section: MeasureSection, excitation: str) -> None: ...

    @abstractmethod
    def check(self, waveform: Waveform) -> str:
        """How the controller is connected, as a sentence; changes nothing.

        Raises
        ------
        MeasurementError
            If it cannot play this excitation so that it ends by itself.
        SourceError
            If its samples cannot be received.
        """

    @abstractmethod
    def start(self, waveform: Waveform) -> None:
        """Ramp up, then repeat the period."""

    @abstractmethod
    def keep(self, played: int) -> None:
        """Continue; to be called at least every 0.1 s. `played`: samples received since the excitation began."""

    @abstractmethod
    def ramp_down(self) -> None:
        """Ramp down; the rest does not need this process."""

    @abstractmethod
    def off(self) -> None:
        """End without a ramp, as fast as the controller can."""

    @abstractmethod
    def close(self) -> None:
        """Release what the player uses; what is not ended is ramped down."""


def make_player(settings: SourceSettings, section: MeasureSection, excitation: str) -> Player:
    """The player for this source; MeasurementError if there is none."""
    if settings.url is None:
        raise ConfigError(
            "key-missing",
            "a measurement needs a live source, whose controller plays the excitation",
            "set source.url, such as hal:sampler.0",
            key="source",
            keys=["url"],
        )
    source = make_source(settings)
    kind = source.address.scheme
    players = {name: one.player for name, one in named("sources").items() if one.player}
    if kind not in players:
        raise MeasurementError(
            "not-playable",
            f"livebode cannot play an excitation on a controller with {kind}",
            f"play the files of `livebode design` there and record; livebode can play on: {', '.join(players)}",
            kind=kind,
            allowed=list(players),
        )
    player: type[Player] = loaded(players[kind])
    return player(source, section, excitation)
