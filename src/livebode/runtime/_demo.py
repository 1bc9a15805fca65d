"""Demonstration without hardware: a simulated axis in motion is tracked while its belt loses stiffness."""

from __future__ import annotations

from functools import partial

from livebode.configuration import FitSection, LoopSection, PIDSection
from livebode.core import Lines, UsageError
from livebode.estimation import Settings, Tracker, plant_kinds
from livebode.excitation import multisine
from livebode.monitoring import Baseline, Monitor, learn_machine
from livebode.runtime.allocation import keep_freed_memory
from livebode.runtime.change_detection import ChangeDetection
from livebode.runtime.estimate import Outcome
from livebode.runtime.feed import Feed
from livebode.runtime.fits import Fits
from livebode.runtime.recorder import Destination
from livebode.runtime.run_loop import RunLoop
from livebode.runtime.single_response import SingleResponse
from livebode.simulation import BeltAxis, Drive, Fault, Friction, Sensor, SimulatedAxis, Strokes, TensionLoss

RATE_HZ, WINDOW, HOP, LOSS = 4000.0, 800, 200, 0.1
SECONDS_MIN = 16.0  # the alarm is raised in the second stroke after the loss
LEARNED_S = 48.0
_SPEEDS_M_PER_S = 0.38, 0.3  # learned at both: equal strokes would put the windows always at the same positions
_AMPLITUDE_N_M = (1.5, 0.8, *[0.5] * 19)  # of each line; 4 N m at the peaks
"""More at the lowest lines: friction at the turning points of the strokes disturbs these most."""


def check_seconds(seconds: float) -> None:
    """UsageError for a length that is out of range."""
    if not SECONDS_MIN <= seconds <= 3600:
        raise UsageError(
            "out-of-range",
            f"{seconds=:g} is not between {SECONDS_MIN:g} and 3600",
            "allow for strokes before and after the loss",
            argument="seconds",
            value=seconds,
        )


def demo_axis(seconds: float, seed: int, *faults: Fault, speed_m_per_s: float = _SPEEDS_M_PER_S[0]) -> BeltAxis:
    """The axis of Nevaranta 2016 on its strokes under a multisine."""
    return BeltAxis(
        motion=Strokes(start_m=0.25, end_m=1.6, speed_m_per_s=speed_m_per_s),
        excitation_n_m=multisine(_lines(), _AMPLITUDE_N_M),
        friction=Friction(load_coulomb_n=15.0),
        sensor=Sensor(noise_rad_per_s=0.1),
        faults=faults,
        seconds=seconds,
        seed=seed,
    )


def demo_settings() -> Settings:
    """Joint estimates at 21 lines, 20 per second, window 0.2 s; the noise is measured at the bins between the lines."""
    return Settings(lines=_lines(), output="velocity", input="u", excitation="w", schedule="x", hop=HOP, noise="quiet")


def demo_baseline(seed: int) -> Baseline:
    """The model of the healthy axis, learned from its strokes at two speeds."""
    # Learning reads its runs eight times: they are simulated once.
    healthy = [
        list(
            SimulatedAxis(demo_axis(LEARNED_S / len(_SPEEDS_M_PER_S), seed + i, speed_m_per_s=speed)).blocks(
                ["u", "velocity", "x"], block_samples=WINDOW
            )
        )
        for i, speed in enumerate(_SPEEDS_M_PER_S)
    ]
    runs = [partial(iter, blocks) for blocks in healthy]
    machine = learn_machine(runs, _lines(), input="u", output="velocity", schedule="x", radius_m=1.0)
    signals: dict[str, str | None] = {"output": "velocity", "input": "u", "excitation": "w", "schedule": "x"}
    return Baseline(_lines(), HOP, signals, "joint", "plant", (), machine)


def demo(to: Destination, *, seconds: float, seed: int, real_time: bool, baseline: Baseline) -> Outcome:
    """Track the simulated axis into a run directory; halfway its belt loses 10 % of its stiffness.

    The baseline's alarm is in the run's events and summary.

    Raises
    ------
    UsageError
        If `seconds` is not between 16 and 3600.
    """
    check_seconds(seconds)
    axis = demo_axis(seconds, seed, TensionLoss(start_s=seconds / 2, loss=LOSS))
    fit, loop = FitSection(radius_m=axis.mechanics.radius_m), described_loop(axis.drive)
    configuration = {
        "demo": {"seconds": seconds, "seed": seed},
        "fit": fit.model_dump(),
        "loop": loop.model_dump(mode="json"),
    }
    settings = demo_settings()
    machine = SimulatedAxis(axis)
    estimate = SingleResponse(
        Tracker(settings),
        Fits(fit, loop.build(RATE_HZ), plant_kinds(machine.channels, settings)),
        ChangeDetection(Monitor(baseline, settings), f"{LEARNED_S:g} s of healthy strokes"),
    )
    about = {"configuration": configuration, "found": {"clock": "relative"}}
    keep_freed_memory()
    feed = Feed(machine, block_samples=400, real_time=real_time)
    return RunLoop(feed, estimate, to, about=about).run()


def described_loop(drive: Drive) -> LoopSection:
    """The axis's loop as in a configuration file."""
    velocity = PIDSection(
        gain=drive.velocity_gain_n_m_s, integral_time_s=drive.integral_time_s, rate_hz=drive.velocity_rate_hz
    )
    held = round(drive.rate_hz / drive.position_rate_hz)
    position = PIDSection(gain=drive.position_gain_per_s, rate_hz=drive.position_rate_hz, rate_divider=held)
    return LoopSection(velocity=velocity, position=position)


def _lines() -> Lines:
    """Odd multiples of 5 Hz: the bins between them, including 50 and 60 Hz, measure the noise."""
    return Lines.parse("15:215:10", rate_hz=RATE_HZ, window=WINDOW)
