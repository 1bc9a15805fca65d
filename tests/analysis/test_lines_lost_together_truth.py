"""Where errors that repeat make all lines invalid together, no mean shows the windows before the verdict as valid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from livebode.analysis import averaged
from livebode.core import Block, Channel, Responses, SignalError
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine, odd_lines
from livebode.fitting import mean_response
from livebode.records import RunRecord
from tests.support.command import livebode
from tests.support.errors import refused
from tests.support.reports import write_run
from tests.support.responses import cut

RATE_HZ, N = 4000.0, 800
LINES = odd_lines(20, 140, RATE_HZ, N, seed=1)
W = multisine(LINES, np.full(len(LINES), 0.3), "random", seed=2)


def block(*stretches: np.ndarray) -> Block:
    w = np.tile(W, sum(y.size for y in stretches) // N)
    channels = (Channel("w"), Channel("u"), Channel("y", "rad"))
    return Block(np.array([w, w, np.concatenate(stretches)]), channels, RATE_HZ)


def coarse(periods: int) -> np.ndarray:
    """The output by a sensor whose steps are larger than what any line does."""
    return np.round(np.tile(0.9 * W, periods))


def fine(periods: int) -> np.ndarray:
    return np.tile(0.9 * W, periods)


def tracked(recorded: Block, **options: object) -> Responses:
    return Tracker(Settings(lines=LINES, output="y", input="u", excitation="w", hop=200, **options)).process(recorded)


@pytest.mark.parametrize("periods", [4, 20])
@pytest.mark.parametrize("average", [False, True])
def test_lines_that_become_invalid_together_have_no_mean_and_the_reason_is_given(periods: int, average: bool) -> None:
    responses = tracked(block(coarse(periods)), average=average)
    assert responses.valid[N // 200].all()  # before the first verdict
    assert not responses.valid[-1].any()
    with refused(SignalError, "no-valid-response"):
        mean_response(cut(responses, 3, 5))


def test_a_run_and_its_export_have_no_average_either(tmp_path: Path) -> None:
    responses = tracked(block(coarse(20)))
    run = write_run(tmp_path / "run", responses)
    with refused(SignalError, "no-valid-response"):
        averaged(RunRecord.open(run))
    done = livebode("export", run, "--to", "csv", "--mean", "--out", tmp_path / "mean.csv")
    assert done.code == 2
    assert "repeat with the excitation" in done.err
    assert (
        livebode("export", run, "--sql", "SELECT DISTINCT distortion FROM responses WHERE NOT valid", "--json").code
        == 0
    )


@pytest.mark.parametrize("average", [False, True])
def test_windows_without_excitation_at_the_end_are_no_reason_against_a_line(average: bool) -> None:
    still = np.zeros(20 * N)
    whole = block(fine(10), still)
    w = np.concatenate([np.tile(W, 10), still])
    recorded = Block(np.array([w, w, whole["y"]]), whole.channels, RATE_HZ)
    assert mean_response(tracked(recorded, average=average))[0].valid.all()
