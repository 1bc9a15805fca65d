"""Error of the indirect estimator for each error in the loop description, on the axis of Nevaranta 2016, Table I."""

from __future__ import annotations

import numpy as np

from livebode import PID, Block, Cascade, Lines, Loop, Settings, Tracker, multisine
from livebode.simulation import TwoMassLoop, TwoMassPlant
from livebode.simulation.two_mass_loop import KPC, KVC, RATE_HZ, TI

LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=400)


def velocity(**wrong: object) -> PID:
    return PID(**({"gain": KVC, "integral_time_s": TI, "rate_hz": RATE_HZ} | wrong))


def position(**wrong: object) -> PID:
    return PID(**({"gain": KPC, "rate_hz": RATE_HZ / 2, "rate_divider": 2} | wrong))


LOOPS = {
    "as it is": Loop(Cascade(velocity(), position())),
    "hold of the position loop missing": Loop(Cascade(velocity(), position(hold="none"))),
    "continuous PI": Loop(Cascade(velocity(integrator="continuous"), position())),
    "wrong integrator rule": Loop(Cascade(velocity(integrator="forward"), position())),
    "no position loop": Loop(velocity()),
    "one tick of delay too many": Loop(Cascade(velocity(delay_ticks=1), position())),
    "w described as logged before the update": Loop(Cascade(velocity(), position()), excitation_logged="before"),
}


def costs() -> dict[str, float]:
    """Largest relative error of the plant for each description."""
    w = multisine(LINES)
    _, y = TwoMassLoop().run(w, periods=2)
    block = Block(np.array([np.tile(w, 2), y[0]]), ("w", "y"), RATE_HZ)
    truth = TwoMassPlant().response(LINES.frequency_hz)
    found = {}
    for name, loop in LOOPS.items():
        settings = Settings(lines=LINES, output="y", excitation="w", estimator="indirect", loop=loop)
        found[name] = float(np.max(np.abs(Tracker(settings).process(block)[-1].value / truth - 1)))
    return found


if __name__ == "__main__":
    for name, cost in costs().items():
        print(f"| {name} | {cost:.1e} |")
