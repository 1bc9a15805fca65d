"""What of Table I (Nevaranta 2016) the simulated axis has: `python examples/table1.py`."""

from __future__ import annotations

import numpy as np

from livebode.simulation import BeltAxis, BeltResponse, Mechanics

PAPER = {0.35: (1.1e6, 190, 91), 0.8: (5.0e5, 130, 61), 1.4: (4.0e5, 115, 54)}


def resonance_hz(masses: int, position_m: float) -> float:
    """Of the largest response near the two-mass resonance."""
    f = np.linspace(30, 130, 100_001)
    plant = BeltAxis(mechanics=Mechanics(masses=masses)).linear(position_m)
    return float(f[np.argmax(np.abs(plant.response(f)) * (f > 1.15 * antiresonance_hz(position_m)))])


def antiresonance_hz(position_m: float) -> float:
    m = Mechanics()
    stiffness, damping = float(m.stiffness_at(position_m)), float(m.damping_at(position_m))
    return BeltResponse(m.inertia_kg_m2, m.load_kg, m.radius_m, stiffness, damping).antiresonance_hz


def main() -> None:
    m = Mechanics()
    print(f"specific stiffness {m.specific_stiffness_n:.0f} N")
    print(
        "| cart, m | Keff, N/m | paper | bs, N s/m | paper | f_res two masses, Hz | three | paper |\n"
        + "|---" * 8
        + "|"
    )
    for x, (stiffness, damping, resonance) in PAPER.items():
        print(
            f"| {x} | {float(m.stiffness_at(x)):.3g} | {stiffness:.2g} | {float(m.damping_at(x)):.0f} | {damping} "
            f"| {resonance_hz(2, x):.1f} | {resonance_hz(3, x):.1f} | {resonance} |"
        )


if __name__ == "__main__":
    main()
