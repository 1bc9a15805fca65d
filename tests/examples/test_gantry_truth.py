"""The example gantry in QEMU: its matrices are those of livebode from the same samples."""

from __future__ import annotations

import numpy as np
import pytest

from bench.mcu_matrix import DWELL, EXCITATION, HOP, LINES, REPETITIONS, SETTLE, play, recording
from livebode.core import Block, MatrixResponses
from livebode_matrix import MatrixSettings, MatrixTracker
from tests.support.targets import need_tools
from tools.firmware import M4F, M7, Core


def tracked(block: Block) -> MatrixResponses:
    settings = MatrixSettings(
        lines=LINES,
        output=["velocity1", "velocity2"],
        input=["u1", "u2"],
        excitation=["w1", "w2"],
        dwell=DWELL,
        settle=SETTLE,
        hop=HOP,
    )
    return MatrixTracker(settings).process(block)


@pytest.mark.parametrize(("core", "bound"), [(M4F, 1e-4), (M7, 1e-11)], ids=["M4F", "M7"])
def test_the_controller_finds_the_matrices_of_the_tracker(core: Core, bound: float, tmp_path) -> None:
    """To the rounding of the type, in comparison with the largest entry of a line."""
    need_tools()
    block = recording()
    found, expected = play(core, tmp_path, block), tracked(block)
    complete = expected.valid.all(axis=(1, 2))
    assert found.newest.tolist() == expected.sample[complete].tolist()
    assert found.valid.all()
    size = np.abs(expected.value[complete]).max(axis=(2, 3), keepdims=True)
    error = (np.abs(found.matrices - expected.value[complete]) / size).max()
    print(f"{core.name}: {error:.1e} of the largest entry")
    assert error < bound
    w = np.tile(EXCITATION.samples, REPETITIONS)
    assert np.abs(found.excitation - w).max() < 1e-7 * np.abs(w).max()


def test_torques_that_do_not_separate_and_a_sample_that_is_not_finite_are_invalid(tmp_path) -> None:
    need_tools()
    block = recording()
    data = block.data.copy()
    data[block.index("u2")] = data[block.index("u1")]
    data[block.index("velocity1"), 4000] = np.nan
    found = play(M4F, tmp_path, Block(data, [channel.name for channel in block.channels], rate_hz=block.rate_hz))
    assert not found.valid.any()
    gone = (found.newest >= 4000) & (found.newest < 4400)
    assert not gone.any()
    assert len(found.newest) > 10
