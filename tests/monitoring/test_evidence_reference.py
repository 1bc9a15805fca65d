"""Evidence of a stretch of windows, compared bit by bit with its definition in plain NumPy and SciPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import shift

from livebode.monitoring import LearnedMachine
from livebode.monitoring.evidence import JUDGED
from livebode.monitoring.model_evidence import ModelEvidence
from livebode.monitoring.naming import ScoredWindows
from livebode.monitoring.ripple import Ripple, allowed_for
from livebode.monitoring.sensitivity import LocalChange, Offset
from livebode.monitoring.stretches import Stretches, WindowStretch
from livebode.motion import shaft_position
from livebode.simulation import Pair, open_belt
from tests.support.axes import LINES
from tests.support.monitored import NAMES, ideal, recorded
from tests.support.shared import shared

Floats = NDArray[np.float64]

WINDOW, RATE_HZ = LINES.window, LINES.rate_hz
OFFSETS = {
    "none": Offset(),
    "directions": Offset(np.array([0.03, -0.02, 0.4, 0.01])),
    "a place": Offset(np.zeros(4), (LocalChange(0.5, 0.03, -0.05),)),
}


@shared
def stretches() -> list[WindowStretch]:
    return Stretches(NAMES, WINDOW, RATE_HZ).process(recorded((0.35, 0.3), seed=7))


def smooth(model: Floats, measured: Floats) -> Floats:
    """`without_drift` as it is described."""
    slow = measured - model
    for early in (WINDOW // 2, (WINDOW - 1) // 2):
        padded = np.pad(slow, (early + 1, WINDOW - 1 - early), mode="edge")
        total = np.cumsum(padded - padded.mean())
        slow = (total[WINDOW:] - total[:-WINDOW]) / WINDOW + padded.mean()
    return model + slow


def driven(machine: LearnedMachine, pairs: list[Pair], u: Floats, x: Floats, offset: Offset) -> Floats:
    """Velocities of the model, (pairs, samples)."""
    model = machine.model
    at = np.linspace(model.low_m, model.high_m, 4096)
    local = np.sum([place.amount * place.share(at) for place in offset.places], axis=0) * np.ones(at.size)
    stiffness = np.interp(x, at, model.stiffness_at(at) * np.exp(offset.logarithms[0] + local))
    damping = np.interp(x, at, model.damping_at(at))
    motor, _ = open_belt(pairs, u, stiffness, damping, rate_hz=RATE_HZ, radius_m=model.radius_m)
    samples = machine.delay_s * RATE_HZ
    return motor if samples == 0 else np.array([shift(row, samples, order=3, mode="nearest") for row in motor])


def defined(machine: LearnedMachine, stretch: WindowStretch, offset: Offset) -> tuple[Floats, Floats, Floats]:
    """Score, information and power of the stretch's windows, at the learned noise."""
    u, y, x = stretch.data
    model, factors = machine.model, np.exp(offset.logarithms)
    inertia, load, damping = model.inertia_kg_m2 * factors[3], model.load_kg * factors[1], factors[2]
    more = 1.0 + 1e-3
    pairs = [Pair(inertia, load, 1.0, damping), Pair(inertia, load, more, damping), Pair(inertia, load * more, 1.0,
             damping), Pair(inertia, load, 1.0, damping * more), Pair(inertia * more, load, 1.0, damping)]  # fmt: skip
    plain, *moved = driven(machine, pairs, u, x, offset)
    slopes = np.array([*((np.array(moved) - plain) / 1e-3), -np.gradient(plain) * RATE_HZ])
    begin = np.arange(stretch.first, stretch.last) * WINDOW - stretch.start
    cut = begin[:, np.newaxis] + np.arange(WINDOW)

    def spectrum(values: Floats, bins: tuple[int, ...]) -> NDArray[np.complex128]:
        return np.asarray(values @ np.exp(-2j * np.pi * np.outer(np.arange(WINDOW), bins) / WINDOW))

    e = spectrum((y - smooth(plain, y))[cut], (*LINES.bins, *LINES.quiet))
    power, e = e.real**2 + e.imag**2, e[:, : len(LINES)]
    slopes = np.array([smooth(slope, np.zeros(x.size)) for slope in slopes])
    slope, weight = spectrum(slopes[:, cut], LINES.bins), 2 / (machine.noise_power * np.ones((len(cut), 1)))
    score = np.einsum("jwl,wl,wl->wj", slope.conj(), e, weight).real
    information = np.einsum("jwl,kwl,wl->wjk", slope.conj(), slope, weight).real
    if len(machine.ripple):
        angle = 2 * np.pi * np.outer(machine.ripple.cycles_per_m, shaft_position(x, y, WINDOW, RATE_HZ))
        torque = np.stack([np.cos(angle), np.sin(angle)], axis=1).reshape(-1, x.size)
        rows = driven(machine, [Pair(model.inertia_kg_m2, model.load_kg)] * len(torque), torque, x, Offset())
        ripple = spectrum(np.array([smooth(row, np.zeros(x.size)) for row in rows])[:, cut], LINES.bins)
        score, information = allowed_for(
            score, information, np.einsum("owl,wl,wl->wo", ripple.conj(), e, weight).real,
            np.einsum("jwl,owl,wl->wjo", slope.conj(), ripple, weight).real,
            np.einsum("owl,pwl,wl->wop", ripple.conj(), ripple, weight).real, machine.ripple.spread,
        )  # fmt: skip
    return score[:, :4], information[:, :4, :4], power


@pytest.mark.parametrize("offset", OFFSETS.values(), ids=list(OFFSETS))
@pytest.mark.parametrize("delay_s", [0.0, 7e-5], ids=["no delay", "delay"])
@pytest.mark.parametrize("orders", [(), (201.0, 60.3)], ids=["no ripple", "ripple"])
def test_a_stretch_has_the_evidence_of_the_definition(
    offset: Offset, delay_s: float, orders: tuple[float, ...]
) -> None:
    ripple = Ripple(np.array(orders), np.full(len(orders), 0.02))
    noisy = np.full(len(LINES.quiet), 1e9)  # so that no window has more noise than was learned
    machine = replace(ideal(), delay_s=delay_s, ripple=ripple, quiet_power=noisy)
    for stretch in stretches()[1:3]:
        seen = ModelEvidence(machine, LINES).process(stretch, offset)
        assert JUDGED in seen.status
        score, information, power = defined(machine, stretch, offset)
        assert np.array_equal(seen.score, score)
        assert np.array_equal(seen.information, information)
        assert np.array_equal(np.hstack([seen.power, seen.quiet_power]), power)


def test_one_active_change_is_allowed_for_as_by_linear_algebra() -> None:
    machine = ideal()
    seen = ModelEvidence(machine, LINES).process(stretches()[1], Offset())
    windows = ScoredWindows(seen.score, seen.information, seen.position_m)
    for j in range(4):
        inverse = np.linalg.inv(seen.information[:, [j]][:, :, [j]])
        gain = seen.information[:, :, [j]] @ inverse
        score = seen.score - np.einsum("rjk,rk->rj", gain, seen.score[:, [j]])
        information = seen.information - gain @ seen.information[:, [j]]
        score[:, j], information[:, j], information[:, :, j] = 0.0, 0.0, 0.0
        found = windows.without([j])
        assert np.array_equal(found.score, score)
        assert np.array_equal(found.information, information)
