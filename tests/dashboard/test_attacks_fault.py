"""Attacks on the page by somebody without a token take neither the page from its owner nor the disk from the record.

LIVEBODE_ATTACK_S=45 lets each attack go on for so long, with 1,100 connections and 1,024 descriptors (`make attacks`),
and prints what the owner and the record noticed.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from tests.support.attacked import Attacked, attacks, watched_during
from tests.support.peers.machine import Machine
from tests.support.peers.peer import until

ATTACK_S = float(os.environ.get("LIVEBODE_ATTACK_S", "0"))
CONNECTIONS, DESCRIPTORS = (1100, 1024) if ATTACK_S else (200, 256)
LOG_BYTES_MAX = 1_000_000
DELAY_S_MAX = 1.0


@pytest.fixture(scope="module", params=["http", "https"] if ATTACK_S else ["http"])
def attacked(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Attacked]:
    folder = tmp_path_factory.mktemp("attacked")
    tls = request.param == "https"
    with Machine(folder, times=1.0) as machine, Attacked(folder, machine, DESCRIPTORS, tls) as found:
        yield found


@pytest.mark.parametrize("name", [name for name, _ in attacks(1)])
def test_an_attack_takes_neither_the_page_nor_the_record(attacked: Attacked, name: str) -> None:
    attack = dict(attacks(CONNECTIONS))[name]
    segment = attacked.closed()
    noticed = watched_during(attacked, attack, ATTACK_S or 0.5)
    longest, record_s = max(noticed.delays_s), noticed.record_s - 1.0
    met = {True: "met", False: "missed"}
    print(
        f"\n{attacked.origin.partition(':')[0]:5} {name:22} longest request {longest:6.3f} s"
        f" ({met[longest <= DELAY_S_MAX]}), segment late by {record_s:6.3f} s ({met[record_s <= DELAY_S_MAX]}),"
        f" {noticed.descriptors} of {attacked.descriptors} descriptors, {noticed.memory_mb:.0f} MB,"
        f" {noticed.log_bytes} bytes of log, answers {noticed.statuses}, load {os.getloadavg()[0]:.1f}"
    )
    assert set(noticed.statuses) == {200}
    assert noticed.log_bytes <= LOG_BYTES_MAX
    assert "Traceback" not in attacked.log.read_text()
    assert noticed.descriptors <= 3 * attacked.descriptors / 4
    until(lambda: attacked.closed() != segment, "the next segment")
