"""What repeats is in the bound, or the line is not valid with its reason; means are ratios of averages.

Short forms of `python -m studies.repeating`. Statistical bounds: 6 runs of 18 lines give a coverage of 60 % to ± 5 %
and one of 95 % to ± 2 % (one standard deviation) if all were independent.
"""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Block, Channel, Event, Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine, odd_lines
from livebode.fitting import mean_response
from studies import hum
from studies.repeating import CASES, Case, measure
from tests.support.found import with_events

RATE_HZ = 4000.0


def case(name: str) -> Case:
    return next(c for c in CASES if c.name == name)


@pytest.mark.parametrize(
    "name",
    [
        "encoder of 14 bits",
        "Coulomb friction of 2 N",
        "position: Coulomb friction of 2 N",
        "backlash of 10 µm, N = 800",
    ],
)
def test_distortion_is_in_the_bounds_of_windows_averages_and_means(name: str) -> None:
    found = measure(case(name), runs=6)
    print(name, found.coverage, found.reasons)
    for one, two in found.coverage.values():
        assert one >= 0.6
        assert two >= 0.93


def test_the_distortion_of_a_position_is_that_of_its_velocity() -> None:
    """Friction of 1 % of the rms torque on a mass: 6 to 238 Hz is 64 dB of the position, and 32 dB of the velocity."""
    lines, rng = odd_lines(6, 240, 1000.0, 500, seed=2), np.random.default_rng(6)
    torque = np.tile(multisine(lines, phases="random", seed=3), 11)
    outputs = [moved(torque, friction * torque.std()) for friction in (0.0, 0.01)]
    found: dict[str, Responses] = {}
    for kind, names in {"position": 0, "velocity": 1}.items():
        y = outputs[1][names] * (1 + 1e-9 * rng.standard_normal(torque.size))
        block = Block(np.array([torque, y])[:, 1500:], (Channel("u"), Channel("y", kind=kind)), 1000.0)
        settings = Settings(lines=lines, output="y", input="u", estimator="direct", average=True, forgetting=1.0)
        found[kind] = Tracker(settings).process(block)[-1:]
    for kind, names in {"position": 0, "velocity": 1}.items():
        now, period = found[kind], slice(-500, None)
        at = list(lines.bins)
        truth = np.fft.rfft(outputs[0][names][period])[at] / np.fft.rfft(torque[period])[at]
        error = np.abs(now.value[-1] - truth)
        assert now.valid.all()
        assert np.mean(error <= now.sigma[-1]) >= 0.9
        assert np.median(now.sigma[-1] / error) < 6  # of a position taken as it is 15
    position, velocity = (np.abs(one.sigma[-1] / one.value[-1]) for one in found.values())
    # A torque, held for a sample, moves a position by cos(x) of its velocity; friction, not held, by sin(x)/x.
    x = np.pi * lines.frequency_hz / 1000.0
    np.testing.assert_allclose(position / velocity, np.tan(x) / x, rtol=0.03)


def moved(torque: np.ndarray, friction: float, substeps: int = 10) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity of a mass with viscous and Coulomb friction, sampled with the torque."""
    step, x, v, rows = 1e-3 / substeps, 0.0, 0.0, []
    small = 2 * step * max(friction, 1e-9) / 1e-3
    for now in torque.tolist():
        rows.append((x, v))
        for _ in range(substeps):
            v += step / 1e-3 * (now - 0.02 * v - friction * np.tanh(v / small))
            x += step * v
    return tuple(np.array(rows).T)


@pytest.mark.parametrize("name", ["hum on a line, with harmonics", "hum on a line, seen before the excitation"])
def test_a_line_with_hum_is_not_valid_and_the_reason_is_recorded(name: str) -> None:
    assert measure(case(name), runs=2).reasons == {"hum": [50.0]}


def test_hum_in_silence_on_an_axis_with_an_encoder_and_friction_leaves_seldom_a_wrong_line_valid() -> None:
    """A short form of `python -m studies.hum`, where one line of 120 is wrong and valid."""
    found = hum.measure(hum.CASES[3], 2000.0, runs=8, seed=3)
    assert found.wrong >= 10
    assert found.wrong_valid <= 1
    assert found.needless == 0


def test_noise_alone_is_no_distortion() -> None:
    found = measure(case("white noise, odd lines"), runs=6)
    assert found.reasons == {}
    assert found.valid == 1.0
    assert found.coverage["average"][0] <= 0.8  # the bound is not wide for safety's sake


@pytest.mark.parametrize(("nonlinear", "noise", "distorted"), [(False, 3.0, 0), (True, 1.0, 20)])
def test_noise_larger_than_the_output_makes_no_line_distorted_and_as_large_hides_no_distortion(
    nonlinear: bool, noise: float, distorted: int
) -> None:
    """20 runs of 8 verdicts, each significant by chance at most once in 1e4."""
    lines, rng, found = odd_lines(20, 140, RATE_HZ, 800, seed=1), np.random.default_rng(5), 0
    for seed in range(20):
        w = np.tile(multisine(lines, phases="random", seed=seed), 10)
        y = np.sign(w) + 0.2 * w / w.std() if nonlinear else w
        y = y + noise * y.std() * rng.standard_normal(w.size)
        found += "distorted" in [event.kind for event in tracked(y, lines, w)[2]]
    assert found == distorted


def tracked(y_of: np.ndarray, lines: Lines, w: np.ndarray, unit: str = "rad") -> tuple[Tracker, Responses, list[Event]]:
    tracker = Tracker(Settings(lines=lines, output="y", input="u", excitation="w"))
    channels = (Channel("w"), Channel("u"), Channel("y", unit))
    return tracker, *with_events(tracker.process, Block(np.array([w, w, y_of]), channels, RATE_HZ))


def test_a_line_below_half_a_step_of_the_sensor_is_not_valid_unless_noise_carries_it_over_the_steps() -> None:
    lines = odd_lines(20, 140, RATE_HZ, 800, seed=1)
    amplitude = np.full(len(lines), 3.0)
    amplitude[2] = 0.3
    w = np.tile(multisine(lines, amplitude, "random", seed=2), 10)
    _, responses, events = tracked(np.round(w), lines, w)
    assert not responses.valid[-1, 2]
    assert responses.valid[-1, [0, 1, 3, 4]].all()
    steps = [event for event in events if event.kind == "steps"]
    assert [event.details["line_hz"] for event in steps] == [lines.frequency_hz[2]]
    assert 0.1 < steps[0].details["steps"] < 0.5
    dithered = np.round(w + np.random.default_rng(3).standard_normal(w.size))
    assert tracked(dithered, lines, w)[1].valid[-1].all()


def test_distortion_is_not_known_where_every_bin_that_it_reaches_is_excited_or_outside() -> None:
    lines = Lines.parse("20:140:20", RATE_HZ, 400)
    w = np.tile(multisine(lines), 10)
    tracker, responses, _ = tracked(w + 1e-3 * w**3, lines, w)
    assert np.isnan(responses.distortion).all()
    assert tracker.found()["judged"]["distortion"] is None


def noisy_input(seed: int) -> Responses:
    """Windows of a plant of gain 2 + j under feedback, at a coherence of 2/3 between excitation and input."""
    lines = Lines.parse("50", RATE_HZ, 400)
    rng, periods = np.random.default_rng(seed), 200
    w = np.tile(multisine(lines), periods)
    ripple = rng.standard_normal((2, 400 * periods)) * np.sqrt(400 / 8)  # |W|²/2 = N²/8 at the line
    u = w + ripple[0]
    y = np.convolve(u, [2.0, 0.0])[: u.size] - 3 * ripple[0] + 0.1 * ripple[1]
    block = Block(np.array([w, u, y]), ("w", "u", "y"), RATE_HZ)
    return Tracker(Settings(lines=lines, output="y", input="u", excitation="w", hop=400)).process(block)


def test_a_mean_is_the_ratio_of_averages_and_not_the_average_of_quotients() -> None:
    found = [noisy_input(seed) for seed in range(20)]
    means = [mean_response(responses)[0] for responses in found]
    plain = np.mean([np.mean(r.value[1:, 0]) for r in found])
    # The bias of a quotient, e^(−ρ)·(G − G') with ρ = 2 and G' = −1 what the noise alone shows.
    assert abs(plain - 2) == pytest.approx(np.exp(-2) * 3, rel=0.4)
    error = np.array([abs(m.value[0] - 2) for m in means])
    assert np.mean(error <= [m.bound(1)[0] for m in means]) >= 0.4  # 63 % less two standard deviations of 20 runs
    assert np.mean(error <= [m.bound(2)[0] for m in means]) >= 0.9
    assert np.mean([m.input_coherence[0] for m in means]) == pytest.approx(2 / 3, abs=0.05)


def moving(x: np.ndarray, noise: str) -> tuple[Tracker, Responses, list[Event], np.ndarray]:
    """Tracker, responses and events of a gain that is the position x, under noise; which rows are settled."""
    lines, rng = Lines.parse("20:140:20", RATE_HZ, 400), np.random.default_rng(4)
    w = np.tile(multisine(lines), 30)
    y = x * w + 0.01 * rng.standard_normal(w.size)
    tracker = Tracker(Settings(lines=lines, output="y", input="u", excitation="w", schedule="x", noise=noise))
    responses, events = with_events(tracker.process, Block(np.array([w, w, y, x]), ("w", "u", "y", "x"), RATE_HZ))
    return tracker, responses, events, responses.sample >= 10 * 400


def test_where_the_schedule_moves_the_noise_is_that_of_detection_lines_and_the_choice_is_recorded() -> None:
    x = 0.8 + 0.6 * np.sin(2 * np.pi * np.arange(30 * 400) / (15 * 400))  # strokes of 15 windows
    auto, ours, events, at = moving(x, "auto")
    _, theirs, others, _ = moving(x, "periods")
    assert ours.valid[at].all()
    assert np.median(theirs.sigma[at] / ours.sigma[at]) > 3
    error = np.abs(ours.value[at] - ours.schedule[at, np.newaxis])
    assert np.mean(error <= ours.bound(2)[at]) >= 0.95
    assert [event.kind for event in events] == ["noise-from-detection-lines"]
    assert auto.found()["judged"]["noise_from_detection_lines"] > 0.8 * len(ours)
    assert others == []


def test_a_gain_that_changes_at_an_even_rate_is_in_the_scatter_by_its_change_within_a_window_alone() -> None:
    """400 windows of 7 lines at a random moment each: 63.2 % to ± 1 % (one standard deviation)."""
    x, rng = np.linspace(0.2, 1.4, 30 * 400), np.random.default_rng(5)  # by 0.04 in a window
    _, found, events, at = moving(x, "periods")
    still = moving(np.ones(x.size), "periods")[1]
    assert events == []
    assert np.median(found.noise[at] / still.sigma[at]) == pytest.approx(1, abs=0.1)
    np.testing.assert_allclose(found.variation[at], (1 - np.exp(-1)) / 2 * 0.04, rtol=0.03)
    moment = found.sample[at, np.newaxis] - rng.integers(0, 400, (np.count_nonzero(at), len(found.lines)))
    error = np.abs(found.value[at] - x[moment])
    assert np.mean(error <= found.bound(1)[at]) == pytest.approx(0.632, abs=0.04)
    assert np.mean(error <= found.bound(2)[at]) >= 0.98


def test_distortion_on_a_line_at_the_mains_is_not_called_hum() -> None:
    """Friction-like distortion of 50 Hz is at its multiples alone, where the mains would be, too."""
    lines = Lines((10,), 800, RATE_HZ, tuple(k for k in range(1, 60) if k % 10))
    w = np.tile(multisine(lines), 40)
    _, responses, events = tracked(
        w + 0.02 * np.sign(w) + 1e-6 * np.random.default_rng(1).normal(size=w.size), lines, w
    )
    assert "hum" not in [event.kind for event in events]
    assert responses.valid[-1].all()


def test_the_noise_is_known_again_behind_the_beginning_of_the_excitation() -> None:
    lines = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=400)
    w = np.concatenate([np.zeros(1050), np.tile(multisine(lines), 30)])
    y = w + 0.05 * np.random.default_rng(2).normal(size=w.size)
    tracker = Tracker(Settings(lines=lines, output="y", input="u", excitation="w", noise="quiet", average=True))
    last = tracker.process(Block(np.array([w, w, y]), (Channel("w"), Channel("u"), Channel("y", "rad")), RATE_HZ))[-1]
    assert last.valid.all()
    assert np.isfinite(last.sigma).all()
