"""The main job without hardware: a simulated axis in motion is tracked while its belt loses stiffness."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.nouns import InputError, Lines, Responses
from livebode.records import Run
from livebode.session.audience import Audience
from livebode.session.axis import FitSection, LoopSection, PIDSection
from livebode.session.destination import Draw, Progress
from livebode.session.fits import Fits
from livebode.session.following import Outcome
from livebode.session.tracking import record
from livebode.simulation import BeltAxis, BeltResponse, Drive, Friction, Sensor, SimulatedAxis, Strokes, TensionLoss

RATE_HZ, WINDOW, HOP, LOSS = 4000.0, 400, 40, 0.1
SECONDS_MIN = 8.0  # two strokes before the loss and two after it
_SCALES = np.linspace(0.75, 1.15, 81)
_PLACES_M = np.linspace(0.25, 1.6, 28)


def demo_axis(seconds: float, seed: int) -> BeltAxis:
    """The axis of Nevaranta 2016 on its strokes under a multisine; halfway the belt loses 10 % of its stiffness."""
    if not SECONDS_MIN <= seconds <= 3600:
        raise InputError(
            f"{seconds=:g} is not between {SECONDS_MIN:g} and 3600; the axis needs strokes before and after"
        )
    return BeltAxis(
        motion=Strokes(start_m=0.25, end_m=1.6, speed_m_per_s=0.38),
        excitation_n_m=multisine(_lines()),
        friction=Friction(load_coulomb_n=15.0),
        sensor=Sensor(noise_rad_per_s=0.1),
        faults=(TensionLoss(start_s=seconds / 2, loss=LOSS),),
        seconds=seconds,
        seed=seed,
    )


def demo_settings() -> Settings:
    """Joint estimates at six lines, a hundred a second, in a window of 0.1 s; bounds that motion does not widen."""
    return Settings(lines=_lines(), output="velocity", input="u", excitation="w", schedule="x", hop=HOP, noise="quiet")


def demo(
    directory: Path,
    *,
    seconds: float,
    seed: int,
    real_time: bool,
    progress: Progress,
    audience: Audience,
    draw: Draw,
) -> tuple[Outcome, str]:
    """Track the simulated axis into a run directory, and say in one sentence what was found.

    `audience` sees what is published. An earlier demo in `directory` is replaced.
    """
    axis = demo_axis(seconds, seed)
    fit, loop = FitSection(radius_m=axis.mechanics.radius_m), _described(axis.drive)
    said = {"demo": {"seconds": seconds, "seed": seed}, "fit": fit.model_dump(), "loop": loop.model_dump(mode="json")}
    outcome = record(
        SimulatedAxis(axis),
        Tracker(demo_settings()),
        directory,
        about={"configuration": said},
        fits=Fits(fit, loop.build(RATE_HZ)),
        block_samples=400,
        real_time=real_time,
        force=True,
        progress=progress,
        audience=audience,
        draw=draw,
    )
    return outcome, finding(Run.open(directory).responses(), axis)


def _described(drive: Drive) -> LoopSection:
    """The axis's loop as a person would write it down."""
    velocity = PIDSection(
        gain=drive.velocity_gain_n_m_s, integral_time_s=drive.integral_time_s, rate_hz=drive.velocity_rate_hz
    )
    held = round(drive.rate_hz / drive.position_rate_hz)
    position = PIDSection(gain=drive.position_gain_per_s, rate_hz=drive.position_rate_hz, held_ticks=held)
    return LoopSection(velocity=velocity, position=position)


def finding(responses: Responses, axis: BeltAxis) -> str:
    """One sentence: when the stiffness changed most, and by how much, with the standard deviation."""
    time_s, scale = stiffness_scale(responses, axis)
    at = _split(scale)
    (before, sigma_before), (after, sigma_after) = _mean(scale[:at]), _mean(scale[at:])
    change = 100 * (after / before - 1)
    sigma = 100 * np.hypot(sigma_before, sigma_after) / before
    if abs(change) <= 3 * sigma:
        return f"The belt's stiffness did not change: {change:+.1f} % ± {sigma:.1f} % at most, at {time_s[at]:.1f} s."
    word = "less" if change < 0 else "more"
    return f"Since {time_s[at]:.1f} s the belt has {abs(change):.1f} % ± {sigma:.1f} % {word} stiffness than before."


def stiffness_scale(responses: Responses, axis: BeltAxis) -> tuple[np.ndarray, np.ndarray]:
    """Time and stiffness over the designed one for each valid response, shape (rows,).

    The scale whose response (14) at the cart's place is nearest to the measured one, all else as designed.
    """
    use = responses.valid.all(axis=1)
    measured = responses.value[use]
    place = np.abs(responses.schedule[use, np.newaxis] - _PLACES_M).argmin(axis=1)
    designed = _designed(responses.lines, axis)
    distance = np.empty((len(measured), len(_SCALES)))
    for i in range(len(_PLACES_M)):
        at = place == i
        rest = (measured[at, np.newaxis] - designed[i]) / np.abs(designed[i])
        distance[at] = np.sum(rest.real**2 + rest.imag**2, axis=2)
    return responses.time_s[use], _vertex(distance)


def _designed(lines: Lines, axis: BeltAxis) -> np.ndarray:
    """The designed response at each place and stiffness scale, shape (places, scales, lines), half a tick late."""
    m, f = axis.mechanics, lines.frequency_hz
    held = np.exp(-1j * np.pi * f / RATE_HZ)
    found = np.empty((len(_PLACES_M), len(_SCALES), len(f)), dtype=np.complex128)
    for i, place in enumerate(_PLACES_M):
        stiffness, damping = float(m.stiffness_at(place)), float(m.damping_at(place))
        for j, scale in enumerate(_SCALES):
            belt = BeltResponse(m.inertia_kg_m2, m.load_kg, m.radius_m, scale * stiffness, damping)
            found[i, j] = belt.response(f) * held
    return found


def _vertex(distance: np.ndarray) -> np.ndarray:
    """Scale at the lowest distance of each row, between the grid's points by a parabola."""
    rows = np.arange(len(distance))
    best = distance.argmin(axis=1).clip(1, len(_SCALES) - 2)
    below, here, above = (distance[rows, best + step] for step in (-1, 0, 1))
    bend = below - 2 * here + above
    offset = np.where(bend > 0, 0.5 * (below - above) / np.where(bend > 0, bend, 1.0), 0.0).clip(-1, 1)
    return np.asarray(_SCALES[best] + offset * (_SCALES[1] - _SCALES[0]))


def _split(scale: np.ndarray) -> int:
    """Index from which the mean differs most from the mean before, with at least a tenth on either side."""
    n = np.arange(1, scale.size)
    left = np.cumsum(scale)[:-1]
    gain = left**2 / n + (scale.sum() - left) ** 2 / (scale.size - n)
    edge = max(1, scale.size // 10)
    return int(edge + np.argmax(gain[edge - 1 : scale.size - edge]))


def _mean(scale: np.ndarray) -> tuple[float, float]:
    """Mean and its standard deviation; windows that overlap count as one."""
    windows = max(2.0, scale.size * HOP / WINDOW)
    return float(scale.mean()), float(scale.std(ddof=1) / np.sqrt(windows))


def _lines() -> Lines:
    return Lines.parse("20:120:20", rate_hz=RATE_HZ, window=WINDOW)
