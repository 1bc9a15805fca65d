"""The checks of the controllers of a gantry: `python -m studies.check_loop_matrix [runs]`.

The controllers of both motors are described, and each is checked with its own signals of recordings in which the other
motor moves too. There is noise on the speeds, which the loop feeds back, and on the recorded torques. A word of the
second controller is wrong; the first is described as it is.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from livebode.configuration import LoopSection
from livebode.core import Block, Lines
from livebode.excitation import MatrixExcitation
from livebode.simulation import GantryLoop
from livebode_control.loop_check.loop_check import LoopCheck, check_loop
from livebode_control.loop_check.loop_equation import LoopSignals
from livebode_control.loop_check.run_loop_check import settled_starts
from studies.result import Verdict

RUNS, RATE_HZ, REPETITIONS = 200, 4000.0, 8
NOISE_RAD_PER_S, TORQUE_NOISE_N_M = 0.01, 0.003
LINES = Lines.parse("10:140:10", RATE_HZ, 400)
EXCITATION = MatrixExcitation.orthogonal(LINES, 2, 0.3, dwell=6, settle=3)
LOOP = GantryLoop(rate_hz=RATE_HZ)
RIGHT: dict[str, Any] = {"gain": 0.3, "integral_time_s": 0.05, "rate_hz": RATE_HZ}
WRONG: dict[str, dict[str, Any]] = {
    "gain, 2 %": {"gain": 0.306},
    "integrator rule": {"integrator": "forward"},
    "one tick of delay": {"delay_ticks": 1},
    "filter left out": {"lowpass_s": 1 / RATE_HZ},
}


def recordings(runs: int, seed: int) -> Iterator[Block]:
    """Recordings of the gantry at the place 0, one experiment after the other."""
    rng = np.random.default_rng(seed)
    w = np.tile(EXCITATION.samples, REPETITIONS)
    for _ in range(runs):
        block = LOOP.simulate(w, noise=NOISE_RAD_PER_S * rng.standard_normal((3, w.shape[1])))
        data = block.data.copy()
        data[[block.index("u1"), block.index("u2")]] += TORQUE_NOISE_N_M * rng.standard_normal((2, len(block)))
        yield replace(block, data=data)


def check(block: Block, motor: int, words: dict[str, Any]) -> LoopCheck:
    """The check of the controller of one motor, described by these words."""
    starts = settled_starts(block, LINES.window, EXCITATION.dwell, EXCITATION.settle)
    names = {"excitation": f"w{motor}", "input": f"u{motor}", "output": f"velocity{motor}"}
    return check_loop(
        LoopSignals.of(block, LINES, **names, starts=starts), LoopSection.model_validate({"velocity": words})
    )


def main(arguments: list[str]) -> int:
    """Print the table."""
    runs = int(arguments[0]) if arguments else RUNS
    of_right = [check(block, motor, RIGHT).verdict for block in recordings(runs, 1) for motor in (1, 2)]
    false = float(np.mean([verdict != "as described" for verdict in of_right]))
    print(Verdict(f"false alarms of {len(of_right)} checks", false, 0.01))
    for seed, (word, wrong) in enumerate(WRONG.items(), 2):
        key = f"loop.velocity.{next(iter(wrong))}"
        found = [check(block, 2, RIGHT | wrong) for block in recordings(runs, seed)]
        named = [key in [one.change.key for one in each.explanations] for each in found]
        print(Verdict(f"{word}: named", float(np.mean(named)), 0.95, at_least=True))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
