"""Strokes of a rigid axis that follows its speed exactly: known friction, orders and a worn tooth, no simulation."""

from __future__ import annotations

from functools import cache

import numpy as np

from livebode.core import Block, Channel
from livebode.monitoring import LearnedTorque, learn_torque
from livebode.motion import Shaft

RATE_HZ, INERTIA, COULOMB, VISCOUS = 1000.0, 0.005, 0.2, 0.01
ORDER, RIPPLE_N_M = 6, 0.03
SHAFTS = (Shaft("motor", 1.0, tuple(range(1, 25))),)


def strokes(
    seed: int, seconds: float = 100.0, *, from_s: float = 0.0, friction: float = 1.0, ripple_n_m: float = RIPPLE_N_M,
    tooth_n_m: float = 0.0, gap_s: float | None = None, kind: str = "velocity",
) -> Block:  # fmt: skip
    """Torque and motion; from `from_s` on friction, the ripple and the torque of a tooth once a turn are these.

    The velocity is differenced from an encoder of 100,000 counts, and so half a sample late.
    """
    generator, count = np.random.default_rng(seed), int(seconds * RATE_HZ)
    parts: list[np.ndarray] = []
    while sum(map(len, parts)) < count:
        speed, turns = generator.uniform(4.0, 12.0), generator.uniform(3.0, 5.0)
        parts += [np.full(int(2 * np.pi * turns / speed * RATE_HZ), way * speed) for way in (1.0, -1.0)]
    ramp = np.hanning(200)
    speed = np.convolve(np.concatenate(parts)[:count], ramp / ramp.sum(), mode="same")
    angle = np.cumsum(speed) / RATE_HZ
    since = np.arange(count) >= from_s * RATE_HZ
    past = (angle + np.pi) % (2 * np.pi) - np.pi
    acting = (
        INERTIA * np.gradient(speed) * RATE_HZ
        + np.where(since, friction, 1.0) * (COULOMB * np.sign(speed) + VISCOUS * speed)
        - np.where(since, ripple_n_m, RIPPLE_N_M) * np.cos(ORDER * angle + 0.5)
        - np.where(since, tooth_n_m, 0.0) * np.exp(-((past / 0.1) ** 2) / 2)
    )
    steps = np.round(angle * 1e5 / (2 * np.pi)) / 1e5 * 2 * np.pi
    motion = steps if kind == "position" else np.diff(steps, prepend=steps[0]) * RATE_HZ
    if gap_s is not None:
        acting[int(gap_s * RATE_HZ)] = np.nan
    unit = "rad" if kind == "position" else "rad/s"
    noisy = acting + 0.02 * generator.standard_normal(count)
    return Block([noisy, motion], (Channel("u", "N m"), Channel("y", unit)), RATE_HZ)


@cache
def learned_torque(kind: str = "velocity", runs: int = 3, first_seed: int = 0) -> LearnedTorque:
    """From healthy runs of 100 s."""
    blocks = [strokes(first_seed + i, kind=kind) for i in range(runs)]
    return learn_torque(
        [(lambda block=block: iter([block])) for block in blocks], input="u", output="y",
        kind="position" if kind == "position" else "velocity", lines_hz=np.zeros(0), shafts=SHAFTS,
    )  # fmt: skip
