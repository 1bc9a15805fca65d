"""No signal may have a name by which the generated program calls something of its own."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.configuration import Axis
from livebode.core import Lines, UsageError
from livebode_drives.plc import plc_project
from livebode_drives.structured_text.project import Project
from livebode_drives.structured_text.sliding_dft import sliding_dft
from tests.support.errors import refused

LINES = Lines((1, 2), 8, rate_hz=1000.0)
PERIOD = [0.0, 1.5, 0.0, -1.5, 0.0, 1.5, 0.0, -1.5]
ROLES = ("excitation", "input", "output", "schedule")
SIGNALS = {"excitation": "zw", "input": "zu", "output": "zy", "schedule": "zx"}


def scopes(texts: list[str]) -> Iterator[tuple[str, list[str]]]:
    """Each unit's name, and all that it declares."""
    for text in texts:
        unit = re.search(r"^(?:PROGRAM|FUNCTION_BLOCK|TYPE) (\w+)", text, re.M).group(1)
        declared = re.findall(r"^    ([\w, ]+?) +: ", text.partition("END_VAR\n\n")[0], re.M)
        yield unit, [name for names in declared for name in names.split(", ")]


def generated(signals: dict[str, str], *, named: bool) -> dict[str, str]:
    source = {"url": "ads://192.168.0.5", "net_id": "5.1.2.3.1.1", "symbol": "MAIN.livebode"}
    axis = {
        "source": source | ({"channels": [*signals.values(), "sample"]} if named else {}),
        "signals": signals,
        "lines": {"frequencies": "100, 200", "window": 20},
    }
    return plc_project(Axis.of(axis, "axis"), rate_hz=1e3, amplitude=0.3, limit=2.0, ring_length=100).files()


PLAIN = dict(scopes(list(generated(SIGNALS, named=True).values())))
TURNED = dict(scopes([sliding_dft(LINES, ["zw"], phase="window")]))
EVERY = sorted(
    {n for own in (PLAIN, TURNED) for unit, found in own.items() for n in (unit, *found)} - {*SIGNALS.values()}
)
MAINS = {"MAIN", *PLAIN, *PLAIN["MAIN"], "F_GetSystemTime"} - {*SIGNALS.values()}


def test_the_names_are_those_that_the_texts_declare() -> None:
    assert {"sample", "livebode", "fbRing", "FB_SlidingDft"} <= MAINS
    assert {"small_cos", "bin", "slot", "counted", "epoch", "s_re"} <= set(EVERY)


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("name", sorted(MAINS))
def test_a_name_of_mains_own_is_refused_in_every_role_and_case(name: str, role: str) -> None:
    for spelt in (name, name.lower(), name.upper(), name.swapcase()):
        for named in (False, True):
            with refused(UsageError, "duplicate", value=spelt, element="signal"):
                generated(SIGNALS | {role: spelt}, named=named)
        if role in ("excitation", "output"):
            channels = ["zw", "zu", spelt] if spelt != "sample" else ["zw", "zu", "sample"]
            excitation, tracked = (spelt, ["zu"]) if role == "excitation" else ("zw", [spelt])
            with refused(UsageError, "duplicate", value=spelt):
                Project(PERIOD, 2.0, LINES, channels, excitation, tracked).files()


@settings(deadline=None, max_examples=300)
@given(
    st.sampled_from(EVERY),
    st.sampled_from([str.lower, str.upper, str.swapcase, str]),
    st.sampled_from(ROLES),
    st.booleans(),
)
def test_any_name_that_a_text_declares_is_refused_or_declared_once(name, case, role, named) -> None:
    """What passes is declared once in each unit, is no unit's name, and MAIN gives a value only to what it makes."""
    spelt = case(name)
    signals = SIGNALS | {role: spelt}
    try:
        files = generated(signals, named=named)
    except UsageError:
        return
    units = dict(scopes(list(files.values())))
    for unit, declared in units.items():
        every = [word.lower() for word in (unit, *declared)]
        assert len(every) == len(set(every))
        assert spelt.lower() not in {other.lower() for other in units}
    given_to = re.findall(r"^(\w+) := ", files["MAIN.st"], re.M)
    assert given_to == [signals["excitation"], "sample"]
