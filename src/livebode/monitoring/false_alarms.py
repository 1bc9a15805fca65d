"""How often a person bears a false alarm, in words, and the threshold that keeps to it."""

from __future__ import annotations

import re
from math import isfinite, log

from livebode.core import UsageError

DEFAULT = "one in 30 days of motion"

_UNITS_S = {
    "second": 1.0,
    "minute": 60.0,
    "hour": 3600.0,
    "day": 86400.0,
    "week": 7 * 86400.0,
    "month": 30.4375 * 86400.0,
    "year": 365.25 * 86400.0,
} | {"s": 1.0, "min": 60.0, "h": 3600.0}
_WRITTEN = "one two three four five six seven eight nine ten eleven twelve"
_NUMBERS = {word: float(number) for number, word in enumerate(_WRITTEN.split(" "), 1)}
_NUMBERS |= {"a": 1.0, "an": 1.0, "once": 1.0, "twice": 2.0}
_LENGTH = r"(?:(?P<length>[\w.]+) )?(?P<unit>[a-z]+?)s?(?: of motion)?"
_RATE = re.compile(r"(?P<count>[\w.]+)(?: times?)?(?: false)?(?: alarms?)? (?:in|per|every|each|an?) " + _LENGTH)
_TIME = re.compile(r"(?:every |each )?" + _LENGTH)
_MOST_S = 1e12


def seconds_between(text: str) -> float:
    """Mean time between false alarms in seconds of judged motion.

    A time that is not said to be of motion is taken as if the machine moved all the time, which is the stricter.

    Raises
    ------
    UsageError
        If the words cannot be read, or the time is not positive.

    Examples
    --------
    >>> seconds_between("one in 30 days of motion"), seconds_between("once a week"), seconds_between("86400")
    (2592000.0, 604800.0, 86400.0)
    >>> seconds_between("2 per year") == seconds_between("one in 6 months")
    True
    """
    words = " ".join(text.lower().split())
    seconds = _plain(words)
    if seconds is None:
        raise UsageError(
            "unreadable",
            f"false alarms {text!r} cannot be read",
            "write for example 'one in 30 days of motion', 'once a year', '2 per month' or a number of seconds",
            argument="false_alarms",
            value=text,
        )
    if not (isfinite(seconds) and 0 < seconds <= _MOST_S):
        raise UsageError(
            "out-of-range",
            f"false alarms {text!r} are not a positive time",
            f"write for example {DEFAULT!r}",
            argument="false_alarms",
            value=text,
        )
    return seconds


def _plain(words: str) -> float | None:
    if (number := _number(words)) is not None:
        return number
    found = _RATE.fullmatch(words) or _TIME.fullmatch(words)
    if found is None:
        return None
    said = found.groupdict()
    unit_s, length = _UNITS_S.get(said["unit"]), _number(said["length"] or "one")
    count = _number(said.get("count") or "one")
    if unit_s is None or length is None or not count:
        return None
    return length * unit_s / count


def _number(word: str) -> float | None:
    if word in _NUMBERS:
        return _NUMBERS[word]
    try:
        return float(word)
    except ValueError:
        return None


def threshold(mean_s: float, step_s: float, charts: int) -> float:
    """Of every one of `charts` CUSUMs of log-likelihood ratios that take a step every `step_s`.

    Lorden (Ann. Math. Stat. 42, 1971): a CUSUM of log-likelihood ratios with threshold h has a mean time between false
    alarms of at least e^h steps, whatever the distribution; the rates of several add up at most. It is a bound: what
    really comes is rarer, for a sum overshoots its threshold.

    >>> round(threshold(2592000.0, 0.1, 8), 1)
    19.1
    """
    return max(log(mean_s / step_s * charts), 1.0)
