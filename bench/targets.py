"""Targets, and the table of results met or missed."""

from collections.abc import Callable
from typing import Any

Record = dict[str, Any]


def _by_bins(few: float, some: float, many: float) -> Callable[[int], float]:
    return lambda bins: few if bins <= 7 else some if bins <= 21 else many


# (kind, question, ours, theirs, bound by instruction set and bins, whether more is better)
NONE = float("nan")
TARGETS: list[tuple[str, str, str, str, dict[str, Callable[[int], float]], bool]] = [
    *(
        (
            "dense",
            f"dense{note} compared with fastgoertzel",
            ours,
            "fastgoertzel",
            {"avx512": _by_bins(12, 12, 12), "avx2": _by_bins(8, 8, 8)},
            True,
        )
        for ours, note in (("livebode", ""), ("livebode fixed", ", fixed phase"))
    ),
    (
        "hop 20",
        "hop 20 compared with fastgoertzel step=20",
        "livebode",
        "fastgoertzel",
        {"avx512": _by_bins(15, 15, 15), "avx2": _by_bins(10, 10, 10)},
        True,
    ),
    (
        "push",
        "push compared with an empty call",
        "livebode",
        "empty call",
        {"avx512": _by_bins(1.35, 1.6, 2.3), "avx2": _by_bins(1.5, 1.9, 3)},
        False,
    ),
    (
        "two channels, FRF every 20",
        "two channels + FRF every 20 compared with RLS",
        "livebode",
        "rls",
        {"avx512": _by_bins(0.5, 0.75, NONE), "avx2": _by_bins(0.6, 1, NONE)},
        False,
    ),
]


def judge(records: list[Record], instruction_set: str) -> list[Record]:
    """One line per cell and question: the ratio, its bound and whether it is reached."""
    lines = []
    for kind, question, ours, theirs, bounds, more in TARGETS:
        for record in (r for r in records if r["kind"] == kind):
            seconds, bins = record["seconds"], record["bins"]
            ratio = seconds[theirs] / seconds[ours] if more else seconds[ours] / seconds[theirs]
            bound = bounds.get(instruction_set, lambda _: NONE)(bins)
            reached = None if bound != bound else bool(ratio >= bound if more else ratio <= bound)
            line = {"question": question, "window": record["window"], "bins": bins}
            lines.append(line | {"ratio": ratio, "bound": bound, "more_is_better": more, "reached": reached})
    return lines


def show(lines: list[Record], instruction_set: str) -> None:
    print(f"\n{instruction_set}: ratios, each with its target")
    question = ""
    for line in lines:
        if line["question"] != question:
            question = line["question"]
            print(f"  {question}")
        sign = "≥" if line["more_is_better"] else "≤"
        target = "" if line["reached"] is None else f"{sign} {line['bound']:<5g}"
        verdict = {None: "", True: "met", False: "missed"}[line["reached"]]
        print(f"    N = {line['window']:<5} K = {line['bins']:<4} {line['ratio']:7.2f} × {target:9}{verdict}")


def show_times(records: list[Record]) -> None:
    print("\nnanoseconds per row (blocks) or per sample (push, FRF)")
    for record in records:
        rows = 4096 if record["kind"] in ("dense", "hop 20") else 1
        times = "  ".join(f"{name} {t / rows * 1e9:.1f}" for name, t in record["seconds"].items())
        print(f"  {record['kind']}, N = {record['window']}, K = {record['bins']}: {times}")
