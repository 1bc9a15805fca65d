"""How the former parser of false-alarm rates read what people write: `python -m bench.decisions.false_alarms`."""

from __future__ import annotations

from bench.decisions.former import code_lines, module, source
from livebode.core import UsageError

PATH = "src/livebode/monitoring/false_alarms.py"
HOUR, DAY = 3600.0, 86400.0
WEEK, MONTH, YEAR = 7 * DAY, 30.4375 * DAY, 365.25 * DAY
MEANT_S = {
    "one in 30 days of motion": 30 * DAY, "once a year": YEAR, "2 per month": MONTH / 2, "86400 s": DAY,
    "one in thirty days": 30 * DAY, "at most one in 30 days": 30 * DAY, "less than one a year": YEAR,
    "max. 1 per month": MONTH, "one in 30 days of operation": 30 * DAY, "1 in 30 days.": 30 * DAY,
    "1 in 30d": 30 * DAY, "1/30 days": 30 * DAY, "1 per 1,000 hours": 1000 * HOUR, "1 per 1000 hours": 1000 * HOUR,
    "1 in 8 hrs": 8 * HOUR, "2,5 per year": YEAR / 2.5, "monthly": MONTH, "two a week": WEEK / 2,
    "one in two weeks": 2 * WEEK, "one every other day": 2 * DAY, "half a day": DAY / 2, "3 in a week": WEEK / 3,
    "no more than 5 a day": DAY / 5, "einer in 30 Tagen": 30 * DAY, "once in 5 years": 5 * YEAR,
    "30": 30 * DAY, "365": YEAR, "P30D": 30 * DAY, "30 d": 30 * DAY, "720:00:00": 30 * DAY,
}  # fmt: skip
"""What 30 people could write, and the mean time in seconds that they mean; a bare number is meant as days."""


def main() -> None:
    parse = module(PATH).seconds_between
    right, rejected, wrong = [], [], []
    for words, meant_s in MEANT_S.items():
        try:
            read_s = parse(words)
        except UsageError:
            rejected.append(words)
            continue
        (right if abs(read_s / meant_s - 1) < 1e-9 else wrong).append((words, read_s / meant_s))
    print(
        f"{len(MEANT_S)} phrases: {len(right)} read as meant, {len(rejected)} rejected, {len(wrong)} read differently"
    )
    print("  rejected:", ", ".join(map(repr, rejected)))
    for words, ratio in wrong:
        print(f"  {words!r} read as {ratio:.3g} times the meant time")
    text = source(PATH)
    print(f"lines of code of the parser: {code_lines(text[: text.index('def threshold')])}")


if __name__ == "__main__":
    main()
