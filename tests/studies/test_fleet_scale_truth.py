"""The paper of `python -m studies.fleet_scale` compared with closed forms, and its simulation with queueing theory."""

from __future__ import annotations

import numpy as np
import pytest

from bench.fleet_loads import SPECTRA
from bench.fleet_path import measured
from studies.fleet_queue import WorkerCosts, arrivals, caught_up_s, stored_times
from studies.fleet_scale import Assumptions, AxisCosts, FleetSize

AXIS = AxisCosts(
    messages_per_s=2.0,
    input_bytes_per_s=1000.0,
    result_bytes_per_s=200.0,
    owner_cores=0.0003,
    server_cores=0.0001,
    responses_per_s=2.0,
    lake_bytes=100.0,
    mean_bytes=100.0,
    state_bytes=2400.0,
    partition_cores=0.001,
)


@pytest.mark.parametrize("load", [0.3, 0.6, 0.9])
def test_a_worker_without_batches_waits_as_an_m_d_1_queue(load: float) -> None:
    """Pollaczek and Khinchine: the mean wait for Poisson arrivals and a service time s is load·s / 2(1 − load)."""
    count, service_s = 60_000, 0.001
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.exponential(service_s / load, count))
    found = stored_times(WorkerCosts(service_s, batch=1, results_s=0.0), [times])[0]
    waits_s = found - times - service_s
    expected_s = load * service_s / 2 / (1 - load)
    # Means of 60 parts scatter by their own standard deviation: four of the mean's are one in 15,000.
    parts = waits_s.reshape(60, -1).mean(axis=1)
    assert abs(parts.mean() - expected_s) < 4 * parts.std() / np.sqrt(len(parts))


def test_results_of_an_idle_worker_are_stored_after_half_a_period_on_average() -> None:
    costs = WorkerCosts(1e-6)
    times = arrivals(50, 1, 0.5, 60.0)
    lags_s = stored_times(costs, times)[0] - times[0]
    assert np.mean(lags_s) == pytest.approx(costs.results_s / 2, rel=0.05)
    assert lags_s.max() < costs.results_s + 3e-3


def test_every_message_is_stored_after_it_arrived_and_in_order() -> None:
    times = arrivals(40, 4, 0.5, 20.0, jitter_s=0.3, seed=2)
    assert sum(map(len, times)) == 40 * 40
    for one, stored in zip(times, stored_times(WorkerCosts(0.005, 0.002, 0.01), times)):
        assert np.all(stored > one)
        assert np.all(np.diff(stored) >= 0)


def test_a_takeover_catches_up_as_the_closed_form_states() -> None:
    """From the claim until nothing waits: the work that waited, over the share of the core that is left."""
    message_s, axes, period_s, waiting_s = 0.003, 100, 0.5, 20.0
    costs = WorkerCosts(message_s, results_s=0.0)
    times = arrivals(axes, 4, period_s, 120.0)
    stored = stored_times(costs, times, waiting_s)
    delayed = [one[after - one > 0.5] for one, after in zip(times, stored)]
    last_s = max(float(one[-1]) for one in delayed)
    assert last_s - waiting_s == pytest.approx(caught_up_s(message_s * axes / period_s, waiting_s), rel=0.05)


def test_cores_and_streams_follow_from_the_costs_of_an_axis() -> None:
    size = FleetSize(AXIS, Assumptions(axes=10_000, copies=3, load=0.5))
    assert size.owner_cores == pytest.approx((10_000 * 0.0003 + 1024 * 0.001) / 0.5)
    assert size.server_cores == pytest.approx(3 * 10_000 * 0.0001 / 0.5)
    assert size.streams == 2
    assert size.computers == 2
    assert size.sites == 25
    assert size.site_bytes_per_s == pytest.approx(400_000)


def test_storage_by_tier_follows_from_the_rates() -> None:
    tiers = FleetSize(AXIS, Assumptions(axes=1000, copies=3)).tiers_bytes()
    assert tiers["log, full rate"] == pytest.approx(1000 * 1000 * 7 * 86400 * 3)
    assert tiers["responses, full rate"] == pytest.approx(1000 * 200 * 7 * 86400)
    assert tiers["minute means"] == pytest.approx(1000 * 100 * 2 * 365.25 * 1440)
    assert tiers["hour means, a year"] == pytest.approx(1000 * 100 * 365.25 * 24)
    assert tiers["states"] == pytest.approx(1000 * 2400 * 3)
    assert tiers["alarms, a year"] == pytest.approx(1000 * 2 * 1000)
    assert tiers["raw around alarms, a year"] == pytest.approx(1000 * 2 * 120 * 1000)


def test_a_large_state_is_stored_when_its_share_of_the_data_is_small_enough() -> None:
    assert AXIS.state_every_s == pytest.approx(2400 / 0.08 / 1000)


def test_the_real_path_stores_a_response_for_every_spectrum_that_was_sent() -> None:
    costs = measured(SPECTRA, 3, 2.0, partitions=2)
    assert (costs.messages, costs.lost, costs.responses) == (12, 0, 12)
    assert len(costs.trace) == 12
    assert np.all(costs.trace["stored_s"] > costs.trace["arrived_s"])
    assert min(costs.owner_s, costs.server_s, costs.generator_s, costs.state_size) > 0
