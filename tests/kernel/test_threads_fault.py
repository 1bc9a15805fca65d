"""A second thread in what one thread changes is refused, and harms nothing."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
import pytest

from livebode import BeltAxis, SlidingDFT
from livebode.kernel import _native
from livebode.simulation import Engine, engine_settings

PLACE_M = 0.8
LONG = 500_000
"""Samples for which the kernel releases the interpreter lock."""


def together(first: Callable[[], object], second: Callable[[], object]) -> tuple[set[str], int]:
    """Two threads repeat one work each until one of them is refused: why, and how often `first` was done.

    With the interpreter lock it is `second` that is refused.
    """
    raised: list[RuntimeError] = []
    done = 0

    def work() -> None:
        nonlocal done
        while not raised:
            try:
                first()
                done += 1
            except RuntimeError as error:
                raised.append(error)

    worker = threading.Thread(target=work)
    worker.start()
    while not raised:
        try:
            second()
        except RuntimeError as error:
            raised.append(error)
    worker.join()
    return {str(one) for one in raised}, done


@pytest.mark.parametrize("call", ["push", "process", "spectrum", "snapshot", "reset", "count"])
def test_a_sliding_dft_takes_one_thread_at_a_time(call: str) -> None:
    x = np.random.default_rng(1).standard_normal(LONG)
    shared, alone = (SlidingDFT(400, bins=range(1, 200)) for _ in range(2))
    actions: dict[str, Callable[[], object]] = {
        "push": lambda: shared.push(1.0),
        "process": lambda: shared.process(np.ones(10)),
        "count": lambda: shared.count,
        **{name: getattr(shared, name) for name in ("spectrum", "snapshot", "reset") if name == call},
    }
    shared.push(0.0)
    before = shared.snapshot()
    harmless = call in ("spectrum", "snapshot", "count")
    raised, done = together(lambda: shared.advance(x), actions[call])
    assert raised == {"this SlidingDFT is processing a block in another thread; give each thread its own"}
    if harmless:
        alone.restore(before)
        for _ in range(done):
            alone.advance(x)
        np.testing.assert_array_equal(shared.spectrum(), alone.spectrum())


def test_a_simulated_axis_takes_one_thread_at_a_time() -> None:
    axis = BeltAxis()
    shared, alone = (Engine(engine_settings(axis), PLACE_M) for _ in range(2))
    rows = 3 + len(shared.plant)
    ticks = LONG // 20
    outputs = np.zeros((2, rows, ticks))
    inputs = still(axis, ticks)
    raised, done = together(lambda: shared.advance(inputs, outputs[0]), lambda: shared.plant)
    assert raised == {"another thread advances this simulated axis; give each thread its own"}
    for _ in range(done):
        assert alone.advance(inputs, outputs[1]) == ticks
    np.testing.assert_array_equal(*outputs)


def still(axis: BeltAxis, ticks: int) -> np.ndarray:
    """What the simulation takes at each tick, with an excitation, so that the axis moves."""
    condition = axis.condition(np.zeros(ticks))
    references = np.zeros((4, ticks))
    references[0] = PLACE_M / axis.mechanics.radius_m
    references[2] = 0.01 * np.random.default_rng(2).standard_normal(ticks)
    belt = [condition.stiffness, condition.damping, condition.load_kg, condition.gap_m, condition.friction]
    return np.vstack([references, *belt, np.zeros(ticks)])


def test_an_array_that_a_call_changes_is_one_thread_s() -> None:
    knots = np.concatenate([[0.0] * 4, np.linspace(0.1, 0.9, 9), [1.0] * 4])
    x, out = np.linspace(0, 1, LONG), np.empty((LONG, knots.size - 4))
    expected = np.empty((10, knots.size - 4))
    _native.curve_splines(knots, x[:10].copy(), expected)

    def work() -> None:
        _native.curve_splines(knots, x, out)

    assert together(work, work)[0] == {"another thread changes this state; give each thread its own"}
    np.testing.assert_array_equal(out[:10], expected)
