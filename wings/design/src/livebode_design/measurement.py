"""`prepare` and `measure`: from an experiment to its recording beside an axis.toml that tracks it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

from livebode.core import ConfigError, MeasurementError, write_whole, writing
from livebode.dataclass import dataclass
from livebode.plugins import loaded, named
from livebode.sources.live import MeasureSection, Player, SourceSettings, make_source
from livebode_design.design import Design
from livebode_design.experiment import Experiment
from livebode_design.experiment_design import design_experiment
from livebode_design.playback import Playback, StopRequest

LOG = "log.csv"


@dataclass(frozen=True)
class ReadyMeasurement:
    """A measurement that could begin now.

    Attributes
    ----------
    design
        What is played.
    player
        What plays it.
    connection
        How the controller is connected.
    excitation
        Channel of the excitation.
    ranges
        Lowest and highest permitted value of each limited channel.
    section
        [measure].
    """

    design: Design
    player: Player
    connection: str
    excitation: str
    ranges: dict[str, tuple[float, float]]
    section: MeasureSection

    def playback(self, say: Callable[[str], None] = lambda _: None) -> Playback:
        """A new one."""
        return Playback(self.design, self.player, self.excitation, self.ranges, self.section.silence_s, say)

    def rows(self) -> list[tuple[str, str]]:
        """What happens, as rows of a table."""
        design = self.design
        limits = [f"{name} {low:g} … {high:g}" for name, (low, high) in self.ranges.items()]
        return [
            ("controller", f"{self.player.source.address}: {self.connection}"),
            ("plays", f"peak {design.waveform.peak:.4g} N m, {len(design.waveform.lines.bins)} lines"),
            ("takes", f"{self.duration_s:.4g} s: ramp up {design.ramp_s:.3g} s, recording {design.recording_s:.4g} s, "
                      f"then the ramp down"),
            ("ramps down beyond", "; ".join(limits) or "nothing: set measure.limits"),
            ("is zero after a stop", f"within {self.player.stop_s:.3g} s (Ctrl-C, SIGTERM, a limit, silence)"),
        ]  # fmt: skip

    @property
    def duration_s(self) -> float:
        """From the first sample to the end of the ramp down."""
        return self.playback().playing_s + self.player.stop_s

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "controller": str(self.player.source.address),
            "connection": self.connection,
            "excitation": self.excitation,
            "limits": {name: list(limit) for name, limit in self.ranges.items()},
            "duration_s": self.duration_s,
            "stop_s": self.player.stop_s,
        }


@dataclass(frozen=True)
class Made:
    """The recording.

    Attributes
    ----------
    log
        Its name in the directory.
    samples, lost
        Number of its samples, and of those that are missing in it.
    """

    log: str
    samples: int
    lost: int


def prepare(experiment: Experiment, *, simulated: bool = False) -> ReadyMeasurement:
    """Design the experiment and check the controller; nothing is played or written.

    With `simulated` the controller is a simulation of the experiment's [belt].

    Raises
    ------
    ConfigError
        If the experiment has no [source], or to be simulated no [belt], or a signal is not one of its channels.
    MeasurementError
        If the controller cannot play the excitation so that it ends by itself.
    DesignError
        If there is no excitation within the limits.
    SourceError
        If the controller is not connected as configured.
    """
    player = _simulated(experiment) if simulated else _controller(experiment)
    signals, limits = experiment.signal_names(), experiment.machine_limits()
    design = experiment.design()
    ranges = experiment.measure.ranges()
    if "input" in signals and limits.torque_n_m_max < inf:
        ranges.setdefault(signals["input"], (-limits.torque_n_m_max, limits.torque_n_m_max))
    connection = player.check(design.waveform)
    return ReadyMeasurement(design, player, connection, signals["excitation"], ranges, experiment.measure)


def _simulated(experiment: Experiment) -> Player:
    """A simulation of the experiment's axis."""
    from livebode_design.simulated import SimulatedPlayer  # with the simulation

    axis = experiment.axis()
    if axis is None:
        raise ConfigError(
            "key-missing",
            "the experiment has no [belt], whose constants are those of the simulated machine",
            "describe the axis by [belt] in place of [measured], as in `livebode example experiment`",
            key="belt",
        )
    return SimulatedPlayer(replace(axis, seconds=inf), experiment.measure)


def _controller(experiment: Experiment) -> Player:
    """The player of the controller in [source]."""
    if experiment.source is None:
        raise ConfigError(
            "key-missing",
            "the experiment has no [source]: the controller that plays and records",
            "add it; wings/design/docs/measure.md has an example",
            key="source",
        )
    return make_player(experiment.source, experiment.measure, experiment.signal_names()["excitation"])


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
    players = {name: kind.player for name, kind in named("sources").items() if kind.player}
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


def measure(
    experiment: Experiment,
    prepared: ReadyMeasurement,
    directory: Path,
    request: StopRequest,
    *,
    say: Callable[[str], None],
    draw: Callable[[Design, Path], object] | None = None,
) -> Made:
    """Write the design to a new directory, play it, and record it there as log.csv; axis.toml uses its steady part.

    Raises
    ------
    MeasurementError
        If a limit, silence or the controller ended it; what was recorded remains.
    OutputError
        If the directory exists, or the disk reports an error.
    """
    design_experiment(experiment.model_copy(update={"log": LOG}), directory, draw=draw)
    playback = prepared.playback(say)
    measured = playback.run(directory / LOG, request)
    first, last = measured.steady
    axis = directory / "axis.toml"
    text = axis.read_text(encoding="utf-8")
    part = f'log = "{LOG}"\nfrom = "{first} samples"\nto = "{last} samples"\n'
    with writing(axis):
        write_whole(axis, text.replace(f'log = "{LOG}"\n', part, 1).encode())
    return Made(LOG, measured.samples, measured.lost)
