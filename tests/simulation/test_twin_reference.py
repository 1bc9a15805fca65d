"""The C simulation is its readable definition, bit by bit, and its method has the coefficients of the book."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import DOP853

from livebode.simulation import (
    Backlash,
    BeltAxis,
    DampingGrowth,
    Drive,
    Friction,
    FrictionChange,
    LoadChange,
    Mechanics,
    Sensor,
    SimulatedAxis,
    SoftSpot,
    TensionLoss,
    engine_settings,
)
from livebode.simulation.fmu import Controller, Now
from tests.support.axes import MULTISINE, compiled, fast_stroke
from tests.twins.plant import Plant

ROOT = Path(__file__).parents[2]

EVERYTHING = {
    "friction": Friction(motor_coulomb_n_m=0.1, motor_viscous_n_m_s=1e-3, motor_stribeck_n_m=0.05, load_coulomb_n=15,
                         load_viscous_n_s_per_m=4, load_stribeck_n=5),
    "drive": Drive(delay_ticks=2, torque_n_m_max=4.0, torque_ripple_n_m=0.2, torque_noise_n_m=0.1),
    "sensor": Sensor(noise_rad_per_s=0.1, encoder_counts_per_turn=1 << 16, encoder_eccentricity_rad=0.003),
    "faults": (TensionLoss(start_s=0.02, loss=0.1), LoadChange(start_s=0.01, ramp_s=0.05, load_kg=1.0),
               DampingGrowth(start_s=0.03, factor=1.5), Backlash(start_s=0.04, ramp_s=0.02, gap_m=1e-4),
               SoftSpot(position_m=0.5, width_m=0.1, loss=0.2), FrictionChange(start_s=0.02, factor=0.6)),
    "mechanics": Mechanics(eccentricity=0.01),
}  # fmt: skip


@pytest.mark.parametrize("masses", [2, 3])
@pytest.mark.parametrize(
    "options",
    [{}, EVERYTHING, {"drive": Drive(velocity_rate_hz=2000, position_rate_hz=1000),
                      "sensor": Sensor(velocity_differenced=True)}],
    ids=["plain", "everything", "slower controllers"],
)  # fmt: skip
def test_c_and_python_give_the_same_bits(masses: int, options: dict) -> None:
    axis = BeltAxis(
        motion=fast_stroke(dwell_s=0.01), excitation_n_m=MULTISINE, seconds=0.1, seed=3,
        **(options | {"mechanics": replace(options.get("mechanics", Mechanics()), masses=masses)}),
    )  # fmt: skip
    block, truth = SimulatedAxis(axis).run()
    settings = engine_settings(axis)
    plant = Plant(settings, axis.motion.start_m)
    controller = Controller(settings, plant.read()[0])
    noise = axis.sensor.noise_rad_per_s * np.random.default_rng(axis.seed).standard_normal(len(block))
    given = [block[name] for name in ("position_reference", "velocity_reference", "w")] + [noise]
    conditions = [getattr(truth.condition, name) for name in ("stiffness", "damping", "load_kg", "gap_m", "friction")]
    noise_n_m = axis.drive.torque_noise_n_m * np.random.default_rng([axis.seed, 2]).standard_normal(len(block))
    for n in range(len(block)):
        assert plant.state == truth.states[:, n].tolist(), n
        now = Now(*(float(row[n]) for row in (*given, *conditions, noise_n_m)))
        torque, velocity, reading = controller.tick(*plant.read()[:2], now)
        assert (torque, velocity, reading) == (block["u"][n], block["velocity"][n], block["position"][n]), n
        plant.step(torque, now)


def test_the_stages_are_those_of_the_book() -> None:
    text = (ROOT / "simulation" / "dop853.h").read_text()
    rows = re.findall(r"\{(\d+),\s+\{([^}]*)\},\s+\{([^}]*)\}\}", text)
    expected = [*DOP853.A[1:], DOP853.B]
    assert len(rows) == len(expected) == 12
    for (terms, stages, weights), row in zip(rows, expected):
        found = np.zeros(12)
        found[[int(s) for s in stages.split(",")]] = [float(w) for w in weights.split(",")]
        assert int(terms) == np.count_nonzero(row)
        assert np.array_equal(found, row)


def test_the_c_source_has_no_warnings_and_no_fused_operations(tmp_path: Path) -> None:
    assembly = compiled(ROOT / "simulation" / "axis.c", tmp_path)
    assert "sqrtsd" in assembly or "fsqrt" in assembly
    assert not re.search(r"\bv?fn?m(add|sub)\d", assembly)
