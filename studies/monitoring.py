"""Changes of the simulated axis: detection, name, amount and place compared with the targets; count of false alarms.

`python -m studies.monitoring` learns a baseline from 40 healthy strokes, then judges 1,000 healthy ones and 1,000 of
each fault, all at random speeds (0.3 … 1 times 0.38 m/s) in both directions, with σ = 0.1 rad/s, friction of 15 N and a
20-bit encoder. It prints numbers and verdicts, and leaves monitoring.json and monitoring.png in the folder that `--out`
names. `--strokes 40` is a short form.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Block, Event
from livebode.monitoring import (
    DEFAULT_INTERVAL_S,
    Evidence,
    LearnedMachine,
    MachineDetector,
    MachineMonitor,
    learn_machine,
)
from livebode.monitoring.charts import threshold
from livebode.monitoring.machine_detector import CHARTS
from livebode.simulation import DampingGrowth, LoadChange, SoftSpot, StrokeSequence, TensionLoss
from studies.monitoring_axis import (
    HIGH_M,
    LINES,
    LOW_M,
    RADIUS_M,
    RATE_HZ,
    WINDOW,
    axis,
    healthy_runs,
    length_s,
    run,
    strokes,
)
from studies.monitoring_drawing import draw

NAMES = ("u", "velocity", "x")
SPOT_WIDTH_M = 0.0777  # of the simulation's bell: 10 cm at half its depth


def learned() -> LearnedMachine:
    return learn_machine(healthy_runs(), LINES, input=NAMES[0], output=NAMES[1], schedule=NAMES[2], radius_m=RADIUS_M)


def monitor(machine: LearnedMachine) -> MachineMonitor:
    return MachineMonitor(machine, LINES, NAMES, DEFAULT_INTERVAL_S)


@dataclass(frozen=True, eq=False)
class Trial:
    """One stroke with a fault from its beginning on, and the events that came before it ended."""

    motion: StrokeSequence
    events: list[Event]

    @property
    def first(self) -> Event | None:
        return next((e for e in self.events if e.kind == "change"), None)

    def found(self, what: str) -> bool:
        return self.first is not None and self.first.details["what"] == what


def trial(machine: LearnedMachine, seed: int, fault: Any, *, whole: bool = False) -> Trial:
    """Events up to the stroke's end; `whole`: of the recording, which ends two windows later."""
    generator = np.random.default_rng(seed)
    motion = strokes(1, generator)
    watcher, events = monitor(machine), []
    for block in run(axis(motion, seed, faults=(fault(generator),)))():
        events += watcher.process(block)
    if whole:
        return Trial(motion, events + watcher.finish())
    events += watcher.rest()
    return Trial(motion, [e for e in events if e.time_s <= length_s(motion)])


class Study:
    def __init__(self, count: int) -> None:
        self.count = count
        self.numbers: dict[str, Any] = {"strokes": count, "targets": []}
        begun = time.process_time()
        self.machine = learned()
        self.numbers["learning_s"] = time.process_time() - begun
        for name in ("held", "free"):
            known = getattr(self.machine, name)
            self.numbers[name] = {k: getattr(known, k).tolist() for k in ("inflation", "scatter", "smallest")}

    def target(self, what: str, value: float, limit: float, at_least: bool = False) -> None:
        met = bool(value >= limit if at_least else value <= limit)
        self.numbers["targets"].append({"what": what, "value": value, "limit": limit, "met": met})
        sign = "≥" if at_least else "≤"
        print(f"  {what:66} {value:9.4g}  {sign} {limit:<7g} {'met' if met else 'missed'}", flush=True)

    def healthy(self) -> None:
        """One monitor over all strokes, one recording of 20 after the other; its evidence is kept for other rates."""
        watcher, kept, events, start = monitor(self.machine), [], [], 0
        begun, generator = time.process_time(), np.random.default_rng(1)
        for i in range(0, self.count, 20):
            motion = strokes(min(20, self.count - i), generator)
            for block in run(axis(motion, 10_000 + i))():
                later = Block(block.data, block.channels, RATE_HZ, start=start + block.start, gap=block.start == 0)
                events += watcher.process(later, kept.append)
            start += -(-block.stop // WINDOW) * WINDOW
        events += watcher.finish(kept.append)
        alarms = [e for e in events if e.kind == "change"]
        seen = Evidence.join(kept)
        self.numbers["healthy"] = {
            "alarms": [e.message for e in alarms],
            "judged_windows": watcher.detector.judged,
            "motion_s": start / RATE_HZ,
            "cpu_s": time.process_time() - begun,
        }
        self.target(f"false alarms in {self.count} healthy strokes", len(alarms), max(1.0, self.count / 1000))
        self._rates(seen[seen.judged])

    def _rates(self, seen: Evidence) -> None:
        """False alarms of other settings on the same healthy windows: the detector restarts after each alarm."""
        step_s = WINDOW / RATE_HZ
        rows = []
        for strokes_between in (5, 20, 100):
            asked_s = strokes_between * len(seen) / self.count * step_s
            alarms, first = 0, 0
            while first < len(seen):
                detector = MachineDetector(self.machine, threshold(asked_s, step_s, CHARTS))
                at = next((i for i in range(first, len(seen)) if raised(detector, seen, i)), len(seen))
                alarms, first = alarms + (at < len(seen)), at + 1
            rows.append({"asked": self.count / strokes_between, "came": alarms})
            print(
                f"  one in {strokes_between} strokes: {alarms} false alarms, {self.count / strokes_between:g} allowed"
            )
        self.numbers["rates"] = rows
        self.target("false alarms over those allowed, at worst", max(r["came"] / r["asked"] for r in rows), 1.0)

    def stiffness(self) -> None:
        done = [trial(self.machine, 100_000 + i, lambda _: TensionLoss(loss=0.005)) for i in range(self.count)]
        self._found("stiffness_0.5", "0.5 % of stiffness", done, "stiffness", -0.5)
        self.target("0.5 % less stiffness: found within one stroke, %", self._share(t.first for t in done), 99, True)

    def _share(self, hits: Any) -> float:
        return 100 * float(np.mean([bool(h) for h in hits]))

    def _found(self, key: str, title: str, done: list[Trial], what: str, truth_percent: float) -> None:
        amounts = [t.first.details["amount_percent"] for t in done if t.found(what) and t.first]
        inside = [
            abs(t.first.details["amount_percent"] - truth_percent) <= t.first.details["bound_percent"]
            for t in done
            if t.found(what) and t.first
        ]
        delay = [t.first.time_s for t in done if t.first]
        self.numbers[key] = row = {
            "found_percent": self._share(t.first for t in done),
            "named_percent": self._share(t.found(what) for t in done),
            "amount_percent_mean": float(np.mean(amounts)),
            "amount_percent_std": float(np.std(amounts)),
            "within_bound_percent": 100 * float(np.mean(inside)),
            "delay_s_median": float(np.median(delay)),
            "delay_s_99": float(np.quantile(delay, 0.99)),
            "further_alarms": sum(sum(e.kind == "change" for e in t.events) > 1 for t in done),
        }
        print(f"\n{title}: {json.dumps({k: round(v, 3) for k, v in row.items()})}", flush=True)

    def ramp(self) -> None:
        """2 % of stiffness in 200 strokes: how much is gone when the alarm comes."""
        lost, named, used = [], 0, 0
        while used < self.count:
            generator = np.random.default_rng(200_000 + used)
            motion = strokes(100, generator)
            ramp_s = 2 * length_s(motion)
            fault = TensionLoss(loss=0.02, ramp_s=ramp_s)
            watcher, first = monitor(self.machine), None
            for block in run(axis(motion, 200_000 + used, faults=(fault,)))():
                first = next((e for e in watcher.process(block) if e.kind == "change"), None)
                if first is not None:
                    break
            time_s = first.time_s if first else float("inf")
            lost.append(2 * time_s / ramp_s)
            named += bool(first and first.details["what"] == "stiffness")
            used += int(np.searchsorted(motion.edges_s(RATE_HZ), min(time_s, length_s(motion))))
        self.numbers["ramp"] = row = {
            "ramps": len(lost),
            "named_stiffness": named,
            "lost_percent_mean": float(np.mean(lost)),
            "lost_percent_most": float(np.max(lost)),
        }
        print(f"\nramps of 2 % in 200 strokes: {json.dumps({k: round(v, 3) for k, v in row.items()})}", flush=True)
        self.target("ramp of 2 % in 200 strokes: lost when found, %, at worst", float(np.max(lost)), 1.0)

    def spot(self) -> None:
        errors, depths, none = [], [], 0
        for i in range(self.count):
            place: list[float] = []

            def fault(generator: np.random.Generator, place: list[float] = place) -> SoftSpot:
                place.append(float(generator.uniform(0.45, 1.4)))
                return SoftSpot(position_m=place[0], width_m=SPOT_WIDTH_M, loss=0.1)

            first = trial(self.machine, 300_000 + i, fault, whole=True).first
            if first is None or first.details["place_m"] is None:
                none += 1
                continue
            errors.append(abs(first.details["place_m"] - place[0]))
            depths.append(first.details["amount_percent"])
        self.numbers["soft_spot"] = row = {
            "not_found_as_a_place": none,
            "error_m_rms": float(np.sqrt(np.mean(np.square(errors)))),
            "error_m_99": float(np.quantile(errors, 0.99)),
            "error_m_most": float(np.max(errors)),
            "depth_percent_mean": float(np.mean(depths)),
        }
        print(f"\nsoft spot of 10 % over 10 cm: {json.dumps({k: round(v, 4) for k, v in row.items()})}", flush=True)
        within = 100 * float(np.sum(np.array(errors) <= 0.02)) / self.count
        self.target("soft spot of 10 % over 10 cm: placed within 2 cm after one stroke, %", within, 99, True)

    def distinguished(self) -> None:
        """2 % more or less of stiffness, and of load."""
        for what, fault, truth in (
            ("stiffness", lambda _: TensionLoss(loss=0.02), -2.0),
            ("load", lambda _: LoadChange(load_kg=0.02 * 6.7), 2.0),
        ):
            seeds = 400_000 if what == "stiffness" else 500_000
            done = [trial(self.machine, seeds + i, fault) for i in range(self.count)]
            self._found(f"{what}_2", f"2 % of {what}", done, what, truth)
            self.target(
                f"2 % of {what}: named {what} within one stroke, %", self._share(t.found(what) for t in done), 99, True
            )

    def damping(self) -> None:
        count = max(self.count // 5, 1)
        done = [trial(self.machine, 600_000 + i, lambda _: DampingGrowth(factor=1.2)) for i in range(count)]
        self._found("damping_20", "20 % more damping", done, "damping", 20.0)

    def windows(self) -> None:
        """Information of one window, and the effect of friction on the slowest stroke, by direction."""
        for speed, seed in ((0.38, 1), (0.114, 2)):
            row = {}
            for way, ends in (("forward", (LOW_M, HIGH_M)), ("return", (HIGH_M, LOW_M))):
                watcher, kept = monitor(self.machine), []
                motion = StrokeSequence(turning_points_m=ends, speeds_m_per_s=(speed,))
                for block in run(axis(motion, seed))():
                    watcher.process(block, kept.append)
                seen = Evidence.join(kept)
                seen = seen[seen.judged]
                information = np.einsum("rjj->rj", seen.information)
                row[way] = {
                    "held_percent": (100 / np.sqrt(np.median(information, axis=0))).tolist(),
                    "free_percent": _free(seen).tolist(),
                    "mean_percent": (100 * seen.score.sum(axis=0) / information.sum(axis=0)).tolist(),
                }
                shown = {k: np.round(v, 3).tolist() for k, v in row[way].items()}
                print(f"  {speed} m/s, {way}: {json.dumps(shown)}")
            self.numbers[f"windows_{speed}"] = row

    def cost(self) -> None:
        """Of the monitor alone, on samples that are there already."""
        blocks = list(run(axis(strokes(10, np.random.default_rng(3)), 3))())
        times = []
        for _ in range(3):
            watcher, begun = monitor(self.machine), time.process_time()
            for block in blocks:
                watcher.process(block)
            times.append(time.process_time() - begun)
        cost_us = min(times) / blocks[-1].stop * 1e6
        self.numbers["cost_us_per_sample"] = cost_us
        print(f"\ncost: {cost_us:.2f} µs per sample, {cost_us * RATE_HZ / 1e4:.2f} % of a core at {RATE_HZ:g} Hz")


def _free(seen: Evidence) -> np.ndarray:
    """Standard deviation of each direction with all others free, median over windows, percent."""
    return np.asarray(100 * np.sqrt(np.median(np.einsum("rjj->rj", np.linalg.inv(seen.information)), axis=0)))


def raised(detector: MachineDetector, seen: Evidence, i: int) -> bool:
    row = np.zeros(len(seen), dtype=bool)
    row[i] = True
    return bool(detector.process(seen[row]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("studies/out"))
    parser.add_argument("--strokes", type=int, default=1000)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    begun = time.process_time()
    study = Study(options.strokes)
    for part in (
        study.windows,
        study.cost,
        study.healthy,
        study.stiffness,
        study.ramp,
        study.spot,
        study.distinguished,
        study.damping,
    ):
        part()
        study.numbers["cpu_s"] = time.process_time() - begun
        (options.out / "monitoring.json").write_text(json.dumps(study.numbers, indent=1) + "\n")
    draw(study.machine, options.out / "monitoring.png")
    missed = [t["what"] for t in study.numbers["targets"] if not t["met"]]
    print(f"\n{study.numbers['cpu_s'] / 60:.1f} min of one core")
    print("all targets met" if not missed else f"missed: {'; '.join(missed)}")


if __name__ == "__main__":
    main()
