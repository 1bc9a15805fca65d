"""Time and places in which a change would not be found count as not monitored, and are reported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from livebode.core import Event
from livebode.monitoring import DEFAULT_INTERVAL_S, Evidence, MachineDetector
from livebode.monitoring.accuracy import WINDOWS, detectable, information_for
from livebode.monitoring.charts import Charts, threshold
from livebode.monitoring.evidence import JUDGED, SLOW
from livebode.monitoring.machine_detector import CHARTS
from livebode.monitoring.monitored_time import WEAK
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.simulation import TensionLoss
from tests.support.axes import LINES, MULTISINE
from tests.support.monitored import changes_of, ideal, recorded, watcher

HEIGHT = threshold(DEFAULT_INTERVAL_S, LINES.window / LINES.rate_hz, CHARTS)


def windows(count: int, information: float, *, seed: int = 1, offset: float = 0.0, first: int = 0) -> Evidence:
    """Judged windows of 0.1 s over the travel, each with so much information about every direction."""
    generator, none = np.random.default_rng(seed), np.zeros((count, 0))
    known = np.tile(np.diag(np.full(4, information)), (count, 1, 1))
    score = known @ np.array([offset, 0.0, 0.0, 0.0]) + np.sqrt(information) * generator.standard_normal((count, 4))
    mark = np.arange(first, first + count)
    return Evidence(
        score=score, information=known, power=none, quiet_power=none, position_m=0.9 + 0.6 * np.sin(mark / 10),
        speed_m_per_s=np.ones(count), time_s=mark / 10, sample=400 * mark, status=np.full(count, JUDGED, dtype="<U12"),
        late_score=np.zeros(count), late_information=np.zeros((count, 5)), ripple_score=none,
        ripple_information=np.zeros((count, 0, 0)), ripple_gain=np.zeros((count, 0, 1)), covariate=none, amplitude=none,
        swing=np.zeros(count),
    )  # fmt: skip


def processed(detector: MachineDetector, seen: Evidence) -> list[Event]:
    """Stretch by stretch, with the scores around the model's offset."""
    events = []
    for i in range(0, len(seen), 10):
        part = seen[np.arange(i, min(i + 10, len(seen)))]
        events += detector.process(replace(part, score=part.score - part.information @ detector.offset.logarithms))
    return events


def test_the_detectable_change_is_found_in_95_of_100_cases() -> None:
    """Charts of 1,000 axes with a change of the size that 600 weak windows are stated to show: 93.5 to 97 % alarms."""
    trials, information, held = 1000, 300.0, ideal().held
    size = float(detectable(np.full(4, WINDOWS * information), held, HEIGHT)[0])
    assert size > 2 * held.smallest[0], "the windows limit it, not the smallest change"
    charts = Charts(np.repeat(held.smallest[:1], trials), np.repeat(held.allowed[:1], trials), HEIGHT)
    generator, found = np.random.default_rng(1), np.zeros(trials, dtype=bool)
    for window in range(WINDOWS):
        score = information * size + np.sqrt(information) * generator.standard_normal(trials)
        charts.step(score, np.full(trials, information), window)
        found |= charts.raised.any(axis=0)
    assert 0.935 <= found.mean() <= 0.97


def test_the_needed_information_is_the_inverse_of_the_detectable_change() -> None:
    held, change = ideal().held, np.array([0.02, 0.01, 0.2, 0.05])
    assert detectable(information_for(change, held, HEIGHT), held, HEIGHT) == pytest.approx(change)
    assert np.all(np.isinf(detectable(np.zeros(4), held, HEIGHT)))


@pytest.mark.parametrize("reason", [WEAK, SLOW], ids=["excitation off", "standstill"])
def test_a_minute_without_information_is_reported_with_its_end(reason: str) -> None:
    detector = MachineDetector(ideal(), HEIGHT)
    assert processed(detector, windows(100, 1e6)) == []
    dark = windows(WINDOWS + 20, 1e-2, first=100)
    if reason == SLOW:
        dark = replace(dark, status=np.full(len(dark), SLOW, dtype="<U12"))
    (blind,) = processed(detector, dark)
    assert (blind.kind, blind.details["reason"]) == ("not-monitored" if reason == WEAK else "idle", reason)
    assert blind.details["what"] == list(DIRECTIONS)
    assert blind.details["since_s"] == pytest.approx(10.0, abs=0.2)
    assert set(blind.details["detectable_percent"].values()) == {None}
    (again,) = processed(detector, windows(50, 1e6, first=100 + len(dark)))
    assert again.kind == "monitored-again"
    assert again.time_s == pytest.approx(72.0, abs=0.5)
    summary = detector.time.summary(0.1)
    assert summary["judged_s"] == pytest.approx(15.0, abs=2.5)
    assert summary["idle_s" if reason == SLOW else "not_monitored_s"] == pytest.approx(60.0, abs=0.2)
    assert bool(summary["not_monitored"]) == (reason == WEAK)


def test_a_weak_direction_alone_is_named() -> None:
    detector = MachineDetector(ideal(), HEIGHT)
    seen = windows(WINDOWS + 10, 1e6)
    seen.information[:, 2, :] = seen.information[:, :, 2] = 0.0
    seen.score[:, 2] = 0.0
    (event,) = processed(detector, seen)
    assert (event.kind, event.details["what"]) == ("not-monitored", ["damping"])
    assert "damping" in event.message
    assert set(detector.time.summary(0.1)["not_monitored"]) == {"damping"}
    assert detector.judged == len(seen)


def test_an_idle_axis_that_moves_without_excitation_is_reported_again() -> None:
    """Standing still is no alarm; moving without information is one, although the same directions are missing."""
    detector = MachineDetector(ideal(), HEIGHT)
    still = windows(WINDOWS, 1e6)
    events = processed(detector, replace(still, status=np.full(len(still), SLOW, dtype="<U12")))
    events += processed(detector, windows(WINDOWS, 1e-3, first=WINDOWS))
    assert [event.kind for event in events] == ["idle", "not-monitored"]


def test_a_run_without_excitation_is_not_judged_and_a_loss_in_it_is_not_denied() -> None:
    monitor = watcher()
    quiet = recorded((0.3,) * 3, TensionLoss(start_s=5.0, loss=0.05), seed=3, excitation_n_m=0.0 * MULTISINE)
    events = monitor.process(quiet) + monitor.finish()
    assert [event.kind for event in events] == ["not-monitored"]
    assert monitor.detector.judged == 0
    summary = monitor.detector.time.summary(0.1)
    assert summary["not_monitored_s"] > 0.9 * len(quiet) / LINES.rate_hz - 2.0


def test_places_that_the_axis_does_not_pass_are_reported() -> None:
    """Sixty seconds between 0.25 and 0.8 m of a travel to 1.6 m."""
    monitor = watcher()
    events = monitor.process(recorded((0.25,) * 18, seed=5, ends=(0.25, 0.8))) + monitor.finish()
    assert [event.kind for event in events] == ["places-not-monitored"]
    (place,) = monitor.detector.places.missing_m
    assert place[0] == pytest.approx(0.85, abs=0.06)
    assert place[1] == pytest.approx(1.6, abs=0.06)
    assert events[0].details["places_m"] == [place]


def test_healthy_strokes_are_monitored_throughout() -> None:
    monitor = watcher()
    events = monitor.process(recorded((0.3,) * 3, seed=7)) + monitor.finish()
    assert changes_of(events) == []
    summary = monitor.detector.time.summary(0.1)
    assert (summary["not_monitored_s"], summary["not_monitored"]) == (0, {})
    assert summary["detectable_percent"]["stiffness"] == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("factor", [3.0, 10.0])
def test_a_stronger_excitation_than_learned_is_no_better_known(factor: float) -> None:
    """What the model omits grows with the excitation, so that it cannot be learned from a weak one."""
    median: list[np.ndarray] = []
    for strength in (1.0, factor):
        kept: list[Evidence] = []
        watcher().process(recorded((0.36, 0.36), seed=9, excitation_n_m=strength * MULTISINE), kept.append)
        information = np.einsum("rjj->rj", Evidence.join(kept).information)
        median.append(np.median(information, axis=0))
    assert np.all(median[1] < 1.1 * median[0])
