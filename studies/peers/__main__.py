"""`python -m studies.peers`: livebode and other methods on the same simulated recordings.

With --write the tables of docs/explanation/peers.md are updated.
"""

from __future__ import annotations

import argparse
import json
import textwrap
from dataclasses import asdict
from pathlib import Path

from studies.peers import cost, starts, table
from studies.peers.compiled import LANGUAGE
from studies.peers.peers import PEERS
from studies.peers.recording import CASES, Case, record
from studies.peers.score import Score, score

ROOT = Path(__file__).parents[2]
PAGE, NUMBERS = ROOT / "docs" / "explanation" / "peers.md", ROOT / "build" / "studies" / "peers.json"
BEGIN, END = "<!-- begin: python -m studies.peers --write -->", "<!-- end -->"


def judge(case: Case, seeds: range) -> dict[str, Score]:
    recordings = [record(seed, case) for seed in seeds]
    return {peer.name: score(recordings, [peer.estimate(recording) for recording in recordings]) for peer in PEERS}


def page(results: dict[Case, dict[str, Score]], seeds: int) -> str:
    recording = record(0)
    costs, fit_s = cost.per_sample_s(recording)
    answers = {peer.name: peer.estimate(recording) for peer in PEERS}
    delays = {name: (answer.delay, answer.waits) for name, answer in answers.items()}
    parts = [f"Root mean squares over {seeds} recordings per case; loops per sample in {LANGUAGE}."]
    parts += [f"### {case.name}\n\n{table.errors(scores)}" for case, scores in results.items()]
    parts.append(f"### Delay, cost and required inputs\n\n{table.terms(costs, delays)}")
    parts.append(
        f"A minimal fit, which all methods except the EKF need in addition, takes {1e6 * fit_s:.0f} µs per response."
    )
    parts.append(textwrap.fill(starts.sentence(), 120, break_on_hyphens=False))
    for case in CASES[:2]:
        parts.append(
            f"### Targets: error in Keff, {case.name[0].lower()}{case.name[1:]}\n\n{table.targets(results[case])}"
        )
    parts.append(f"### Best method in each case\n\n{table.winners(results)}")
    return "\n\n".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m studies.peers", description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="recordings of each case")
    parser.add_argument("--write", action="store_true", help="update the tables of docs/explanation/peers.md")
    options = parser.parse_args()
    results = {case: judge(case, range(options.seeds)) for case in CASES}
    text = page(results, options.seeds)
    print(text)
    NUMBERS.parent.mkdir(parents=True, exist_ok=True)
    numbers = {case.name: {name: asdict(found) for name, found in row.items()} for case, row in results.items()}
    NUMBERS.write_text(json.dumps(numbers, indent=1) + "\n")
    if options.write:
        before, rest = PAGE.read_text().split(BEGIN)
        PAGE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
