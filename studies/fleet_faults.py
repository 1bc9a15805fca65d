"""Random faults of fleets, and a check that every response is stored exactly once.

`python -m studies.fleet_faults 1000` starts fleets, several at once, each with a log, a coordinator with two workers,
and simulated axes that send in real time. It kills a worker, freezes one and lets it continue, kills and restarts the
log, the coordinator, or the coordinator with its workers, repeats and reorders messages, and stops the log for so long
that the buffers at the edge are full. One to five faults begin at random moments within three seconds, and so most of
them meet the consequences of another one: a kill during a takeover, a restart of the log while a worker is frozen. The
next ones begin only when every partition has stored results of messages that were sent after the last fault.

After each round of faults all responses of its fleet are computed again from the log, without interruption, and
compared bit for bit. The longest time without a new result is measured first, by faults that happen alone.

Each finished round is recorded in a file, and the same command continues after an interruption.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from livebode_plant.fleet.replay import AxisCheck
from livebode_plant.fleet.status import silences
from studies.faulty_fleet import LATE_MAX, PARTITIONS, FaultyFleet

SHARES = {
    "kill": 8,
    "freeze": 6,
    "broker": 8,
    "coordinator": 2,
    "service": 2,
    "repeats": 6,
    "reordering": 6,
    "buffer": 2,
}
"""How often a kind occurs among 40 faults."""
TARGETS_S = {"kill": 5.0, "broker": 7.0, "freeze": 15.0, "coordinator": 15.0, "service": 15.0}
ROUND = sum(SHARES.values())
"""Faults before a check; each round has a log of its own."""
GROUP_MAX, WITHIN_S = 5, 3.0
"""Most faults that begin within a time, in seconds."""
ALONE = 5
"""Faults of each kind with a target that happen alone."""


@dataclass(frozen=True)
class RoundResult:
    """What a round found.

    Attributes
    ----------
    number
        Of the round; 0 is the one whose faults happen alone.
    axes
        Of the fleet.
    kinds
        Faults by kind.
    meetings
        Faults that began before their fleet had recovered from an earlier one, by both kinds: "kill during freeze".
    dropped, lost
        Samples that the edges' buffers dropped, and samples that the owners report as lost: these, and those of
        reordered messages that came too late.
    silence_s
        Longest time without a new result by kind, of faults that happened alone.
    failure
        Why the round could not be finished; empty if it was.
    """

    number: int
    axes: int
    kinds: dict[str, int]
    meetings: dict[str, int] = field(default_factory=dict)
    overlapping: int = 0
    takeovers: int = 0
    check: dict[str, int] = field(default_factory=dict)
    dropped: int = 0
    lost: int = 0
    silence_s: dict[str, float] = field(default_factory=dict)
    took_s: float = 0.0
    failure: str = ""

    @property
    def faults(self) -> int:
        return sum(self.kinds.values())

    @property
    def exact(self) -> bool:
        """Whether all responses are right, and no sample is lost without a report or reported without a reason.

        Buffers are small, and drop samples, in a round with the kind `buffer` alone.
        """
        late = self.kinds.get("reordering", 0) * self.axes * LATE_MAX
        buffered = self.dropped == 0 or "buffer" in self.kinds
        return not self.failure and AxisCheck(**self.check).exact and buffered and 0 <= self.lost - self.dropped <= late


@dataclass(frozen=True)
class Campaign:
    """The rounds until now.

    Attributes
    ----------
    took_s
        Time that the runs of the command took, without what is between them.
    """

    rounds: Sequence[RoundResult]
    took_s: float = 0.0

    @property
    def faults(self) -> int:
        return sum(one.faults for one in self.rounds)

    @property
    def total(self) -> AxisCheck:
        """The sum of all comparisons."""
        return AxisCheck(**self.sums("check"))

    @property
    def exact(self) -> bool:
        return all(one.exact for one in self.rounds)

    def sums(self, name: str) -> dict[str, int]:
        """The sum over all rounds, key by key."""
        found: Counter[str] = Counter()
        for one in self.rounds:
            found.update(getattr(one, name))
        return dict(found)

    def sum(self, name: str) -> int:
        """The sum over all rounds."""
        return sum(getattr(one, name) for one in self.rounds)

    def summary(self) -> dict[str, Any]:
        """Plain data."""
        counts = {name: self.sum(name) for name in ("overlapping", "takeovers", "dropped", "lost")}
        silence = {kind: value for one in self.rounds for kind, value in one.silence_s.items()}
        return {
            "faults": self.faults, "exact": self.exact, "kinds": self.sums("kinds"), **counts, **asdict(self.total),
            "silence_s": silence, "failures": [one.failure for one in self.rounds if one.failure],
            "meetings": self.sums("meetings"), "took_s": round(self.took_s), "processors": os.cpu_count(),
        }  # fmt: skip


def alone_round(axes: int, seed: int) -> RoundResult:
    """Faults that happen alone, one after the other, and how long a partition had no new result."""
    rng = random.Random(f"{seed}: alone")
    kinds = [kind for kind in TARGETS_S for _ in range(ALONE)]
    rng.shuffle(kinds)
    return fault_round(0, [(kind,) for kind in kinds], axes, rng)


def overlapping_round(number: int, faults: int, kinds: Sequence[str], axes: int, seed: int) -> RoundResult:
    """A round of groups of faults."""
    rng = random.Random(f"{seed}: {number}")
    bag = [kind for kind in kinds for _ in range(SHARES[kind])]
    rng.shuffle(bag)
    chosen = [bag[index % len(bag)] for index in range(faults)]
    groups = []
    while chosen:
        size = rng.randint(1, GROUP_MAX)
        groups.append(tuple(chosen[:size]))
        chosen = chosen[size:]
    return fault_round(number, groups, axes, rng)


def fault_round(number: int, groups: Sequence[Sequence[str]], axes: int, rng: random.Random) -> RoundResult:
    """A fleet, groups of faults, and the check; in round 0 the time without a result is measured."""
    folder, began_s = Path(tempfile.mkdtemp(prefix="fleet-faults-")), time.monotonic()
    kinds = Counter(kind for group in groups for kind in group)
    meetings: Counter[str] = Counter()
    silence_s: dict[str, float] = {}
    try:
        with FaultyFleet(folder, axes, kinds, rng) as fleet:
            for group in groups:
                time.sleep(rng.uniform(0.0, 1.0))
                if number:
                    meetings += _happen(fleet, group, rng)
                else:
                    silence_s[group[0]] = max(silence_s.get(group[0], 0.0), _silence_s(fleet, group[0]))
            check, dropped, lost = fleet.finished()
    except Exception as error:  # the other rounds say something too
        took_s = time.monotonic() - began_s
        return RoundResult(number, axes, dict(kinds), took_s=took_s, failure=f"{error!r}; its files are in {folder}")
    result = RoundResult(
        number, axes, dict(kinds), dict(meetings), sum(len(group) - 1 for group in groups), check.claims - PARTITIONS,
        asdict(check.total), dropped, lost, silence_s, time.monotonic() - began_s,
    )  # fmt: skip
    if result.exact:
        shutil.rmtree(folder)
        return result
    return RoundResult(**asdict(result) | {"failure": f"its files are in {folder}"})


def _happen(fleet: FaultyFleet, kinds: Sequence[str], rng: random.Random) -> Counter[str]:
    """Let faults begin at random moments, and wait until the fleet has recovered; which kind met which others."""
    begins_s = sorted(rng.uniform(0.0, WITHIN_S) for _ in kinds)
    with ThreadPoolExecutor(len(kinds)) as threads:
        happening, began_s = [], time.monotonic()
        for kind, begin_s in zip(kinds, begins_s):
            time.sleep(max(0.0, began_s + begin_s - begins_s[0] - time.monotonic()))
            happening.append(threads.submit(fleet.fault, kind))
        for one in happening:
            one.result()
    fleet.recovered()
    met = [f"{kind} during {before}" for index, kind in enumerate(kinds) for before in sorted(set(kinds[:index]))]
    return Counter(met)


def _silence_s(fleet: FaultyFleet, kind: str) -> float:
    fleet.settled()
    began_s = time.time()
    fleet.fault(kind)
    fleet.recovered()
    longest: dict[int, float] = fleet.asked(lambda log: silences(log, began_s, time.time()))
    return max(longest.values())


def campaign(
    faults: int, *, axes: int, kinds: Sequence[str], seed: int, at_once: int, alone: bool, record: Path
) -> Iterator[Campaign]:
    """The campaign after each of its rounds; those that are in `record` are not repeated."""
    asked = {"faults": faults, "axes": axes, "kinds": list(kinds), "seed": seed, "alone": alone}
    rounds, before_s = _recorded(record, asked)
    first = ALONE * len(TARGETS_S) if alone else 0
    sizes = {number + 1: min(ROUND, faults - done) for number, done in enumerate(range(first, faults, ROUND))}
    began_s = time.monotonic()

    def found(one: RoundResult) -> Campaign:
        rounds.append(one)
        now = Campaign(rounds, before_s + time.monotonic() - began_s)
        text = json.dumps({"asked": asked, "summary": now.summary(), "rounds": [asdict(each) for each in rounds]})
        record.parent.mkdir(parents=True, exist_ok=True)
        record.with_suffix(".new").write_text(text)
        record.with_suffix(".new").replace(record)
        return now

    yield Campaign(list(rounds), before_s)
    done = {one.number for one in rounds}
    if alone and 0 not in done:
        yield found(alone_round(axes, seed))
    with ProcessPoolExecutor(at_once, get_context("spawn")) as pool:
        running = [
            pool.submit(overlapping_round, number, size, kinds, axes, seed)
            for number, size in sizes.items()
            if number not in done
        ]
        for one in as_completed(running):
            yield found(one.result())


def _recorded(path: Path, asked: dict[str, Any]) -> tuple[list[RoundResult], float]:
    if not path.exists():
        return [], 0.0
    found = json.loads(path.read_text())
    if found["asked"] != asked:
        sys.exit(f"{path} has a campaign with other options: {found['asked']}; remove it or choose another --record")
    return [RoundResult(**one) for one in found["rounds"]], float(found["summary"]["took_s"])


def main() -> None:
    """Run the campaign that the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m studies.fleet_faults", description=__doc__)
    parser.add_argument("faults", type=int, nargs="?", default=1000)
    parser.add_argument("--axes", type=int, default=4, help="of each fleet")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--at-once", type=int, default=3, help="fleets at once")
    parser.add_argument("--kinds", default=",".join(SHARES), help="of faults that overlap, joined by commas")
    parser.add_argument("--record", type=Path, default=Path("build/fleet-faults.json"), help="file of the rounds")
    asked = parser.parse_args()
    found = Campaign([])
    for found in campaign(
        asked.faults, axes=asked.axes, kinds=asked.kinds.split(","), seed=asked.seed, at_once=asked.at_once,
        alone=True, record=asked.record,
    ):  # fmt: skip
        _print_progress(found)
    _print_summary(found)
    print(f"recorded in {asked.record}")
    sys.exit(not found.exact)


def _print_progress(found: Campaign) -> None:
    if found.rounds:
        last, total = found.rounds[-1], found.total
        print(
            f"round {last.number}: {last.faults} faults in {last.took_s:.0f} s, {last.takeovers} takeovers; until now "
            f"{found.faults} faults, {total.missing} missing, {total.doubled} doubled, "
            f"{total.different + total.unexpected} different; {found.took_s / 60:.1f} min",
            flush=True,
        )


def _print_summary(found: Campaign) -> None:
    total, kinds, meetings = found.total, found.sums("kinds"), found.sums("meetings")
    print(f"\n{found.faults} faults in {found.took_s / 60:.1f} min: ", end="")
    print(", ".join(f"{kind} {count}" for kind, count in kinds.items()))
    print(f"{found.sum('overlapping')} of them began before their fleet had recovered from an earlier one, for example")
    for text, count in Counter(meetings).most_common(8):
        print(f"  {count:4} × {text}")
    print(f"{found.sum('takeovers')} takeovers, {total.responses:,} responses")
    print(f"missing {total.missing}, doubled {total.doubled}, different {total.different + total.unexpected}")
    print(f"samples dropped by full buffers {found.sum('dropped'):,}, reported as lost {found.sum('lost'):,}")
    for one in found.rounds:
        for kind, longest in sorted(one.silence_s.items()):
            met = "met" if longest <= TARGETS_S[kind] else "missed"
            print(f"longest silence, {kind:<12}{longest:6.1f} s, target ≤ {TARGETS_S[kind]:g} s: {met}")
        if one.failure:
            print(f"round {one.number} failed: {one.failure}")


if __name__ == "__main__":
    main()
