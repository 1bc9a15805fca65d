"""A small campaign of faults against a fleet with Dask's workers: nothing is missing, doubled or different."""

from __future__ import annotations

from studies.fleet_faults import campaign


def test_a_worker_and_a_log_that_are_killed_and_messages_in_another_order_cost_no_response() -> None:
    kinds = ("kill", "broker", "reordering")
    found = campaign(len(kinds), axes=2, kinds=kinds, seed=2)
    assert found.exact, found.total
    assert found.faults == len(kinds)
    assert found.takeovers > 0
    assert found.total.responses > 0
    assert found.lost == 0
