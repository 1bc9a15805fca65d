"""What Structured Text or a PLC cannot take is refused, with the value and what would do."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from livebode.core import InputError, Lines
from livebode.structured_text import Project, multisine, ring_block, ring_type, sliding_dft
from tests.command import livebode

LINES = Lines((1, 2), 8, rate_hz=1000.0)
PERIOD = [0.0, 1.5, 0.0, -1.5]

AXIS = """\
[source]
url = "ads://192.168.0.5"
net_id = "5.1.2.3.1.1"
symbol = "MAIN.livebode"
channels = ["w [N m]", "y [rad/s]"]
[signals]
excitation = "w"
output = "y"
[lines]
frequencies = "100, 200"
window = 20
"""


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("motor velocity", "'motor velocity' has a character that is not allowed in Structured Text; motor_velocity"),
        ("2nd", "'2nd' begins with a digit, which is not allowed in Structured Text; x2nd would do"),
        ("Limit", "'Limit' is a keyword in Structured Text; Limit_1 would do"),
        ("END_IF", "'END_IF' is a keyword"),
        ("udint_to_lreal", "'udint_to_lreal' is a keyword"),
        ("a__b", "'a__b' has two underscores in a row.*; a_b would do"),
        ("a_", "'a_' has two underscores in a row, one at its end.*; a would do"),
        ("x" * 33, f"has 33 characters, more than 32, in Structured Text; {'x' * 32} would do"),
        ("φ", "'φ' has a character that is not allowed in Structured Text; x would do"),
        ("", "'' has .*; x would do"),
        (
            "Count",
            "'Count' is a name that the generated text needs itself in Structured Text, which knows no case; Count_1",
        ),
        ("U", "'U' is the same as 'u' in Structured Text, which knows no case; U_1 would do"),
    ],
)
def test_a_channel_name_that_structured_text_forbids(name: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        sliding_dft(LINES, ["u", name])


def test_every_kind_of_name_is_held_to_the_same() -> None:
    for make in (
        lambda: sliding_dft(LINES, ["u"], name="FB__Dft"),
        lambda: multisine(PERIOD, rate_hz=1e3, limit=2, name="FB__Multisine"),
        lambda: ring_type(1, 1e3, name="ST__Ring"),
        lambda: ring_block(["u"], name="FB__Ring"),
        lambda: ring_block(["u"], type_name="ST__Ring"),
        lambda: Project(PERIOD, 2.0, LINES, ["w", "u"], "w", ["w", "u"], counter="s__n").files(),
    ):
        with pytest.raises(InputError, match="two underscores"):
            make()
    with pytest.raises(InputError, match="'stamp' is a name that the generated text needs itself"):
        ring_block(["stamp"])
    with pytest.raises(InputError, match="'fbring' is a name that the generated text needs itself"):
        Project(PERIOD, 2.0, LINES, ["w", "fbring"], "w", ["w"]).files()


@pytest.mark.parametrize(
    ("period", "given", "said"),
    [
        (PERIOD, {"limit": 1.2}, "peak of 1.5 exceeds limit=1.2; scale it by at most 0.7996, or raise the limit"),
        (PERIOD, {"limit": 0.0}, "limit=0.0 is no finite number above 0; give the most that drive and machine bear"),
        (PERIOD, {"limit": np.inf}, "limit=inf is no finite number above 0"),
        (PERIOD, {"limit": np.nan}, "limit=nan is no finite number above 0"),
        (PERIOD, {"rate_hz": 0.0}, "rate_hz=0.0 is not above 0"),
        (PERIOD, {"ramp_periods": 0}, "ramp_periods=0 is not from 1 to 262143 periods"),
        ([0.0, 0.0], {}, "the period is nowhere larger than 0.0; give an excitation"),
        ([1e-320, 0.0], {}, "the period is nowhere larger than 1e-320; give an excitation"),
        ([1.0, np.nan], {}, "sample 1 of the period is nan"),
        (np.ones(16385), {}, r"shape \(16385,\) is not one of 2 to 16384 samples"),
        ([[1.0, 2.0]], {}, r"shape \(1, 2\)"),
    ],
)
def test_an_excitation_that_no_block_can_play(period, given: dict[str, float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        multisine(period, **({"rate_hz": 1e3, "limit": 2.0} | given))


sizes = st.floats(1e-100, 1e100)


@settings(deadline=None)
@given(st.lists(st.floats(-1.0, 1.0, width=32), min_size=2, max_size=8).filter(any), sizes, sizes)
@example([0.0, 1.0, -1.0], 1.5, 1.2)
@example([1.0, 0.5], 35.6326, 2.0)
def test_the_scale_that_a_refusal_names_passes_and_a_larger_one_by_a_thousandth_does_not(shape, size, limit) -> None:
    period = np.array(shape) * size
    try:
        multisine(period, rate_hz=1e3, limit=limit)
    except InputError as error:
        scale = float(re.search(r"scale it by at most (\S+), or raise the limit", str(error)).group(1))
        assert multisine(period * scale, rate_hz=1e3, limit=limit)
        with pytest.raises(InputError, match="exceeds"):
            multisine(period * scale * 1.002, rate_hz=1e3, limit=limit)


def test_what_does_not_fit_a_plc_is_refused_with_what_would() -> None:
    with pytest.raises(InputError, match=r"of 1000000 samples takes \d+ bytes .* 8388608; take at most 349523 samples"):
        sliding_dft(Lines((1,), 1_000_000, rate_hz=1e3), ["u"])
    assert sliding_dft(Lines((1,), 349_523, rate_hz=1e3), ["u"])
    with pytest.raises(InputError, match=r"of 4 channels of 300000 samples .* take at most 262142 samples"):
        ring_type(4, 1e3, length=300_000)
    assert ring_type(4, 1e3, length=262_142)
    with pytest.raises(InputError, match="length=1 samples is too short; take at least 2"):
        ring_block(["u"], length=1)
    with pytest.raises(InputError, match=r"channels \[\] are not 1 to 16 names"):
        sliding_dft(LINES, [])
    with pytest.raises(InputError, match="65 channels is not one of 1 to 64"):
        ring_type(65, 1e3)
    with pytest.raises(InputError, match="rate_hz=nan is not above 0"):
        ring_type(1, np.nan)
    with pytest.raises(InputError, match="phase='sideways' is not known; take 'fixed' or 'window'"):
        sliding_dft(LINES, ["u"], phase="sideways")
    with pytest.raises(InputError, match="there is no channel 'z'; known here: w, u"):
        Project(PERIOD, 2.0, LINES, ["w", "u"], "w", ["z"]).files()


@pytest.mark.parametrize(
    ("change", "more", "said"),
    [
        (("", ""), ("--rate", 0), "rate"),
        (("", ""), (), "the rate of the PLC's task is missing"),
        (('excitation = "w"', ""), ("--rate", 1000), "signals.excitation is missing"),
        (("window = 20", ""), ("--rate", 1000), "lines or window are 'auto'"),
        (('"100, 200"', '"100, 600"'), ("--rate", 1000), "600 Hz is not between 0 and the Nyquist frequency 500 Hz"),
        (('"100, 200"', '"110"'), ("--rate", 1000), "nearest lines are 100 and 150 Hz"),
        (('output = "y"', 'output = "z"'), ("--rate", 1000), "there is no channel 'z'; known here: w, y"),
        (('"w [N m]"', '"two words"'), ("--rate", 1000), "there is no channel 'w'"),
        (("", ""), ("--rate", 1000, "--limit", 0.1), "exceeds limit=0.1; scale it by at most"),
        (("", ""), ("--rate", 1000, "--amplitude", "nan"), "amplitude=nan is not a finite number"),
        (("", ""), ("--rate", 1000, "--ring", 1), "too short"),
    ],
)
def test_the_command_refuses_in_a_sentence_and_writes_nothing(change, more, said: str, tmp_path: Path) -> None:
    axis, out = tmp_path / "axis.toml", tmp_path / "out"
    axis.write_text(AXIS.replace(*change) if change[0] else AXIS)
    done = livebode("plc", axis, "--amplitude", 0.3, "--limit", 2, *more, "--out", out)
    assert done.code == 2
    assert said in done.err
    assert not out.exists()


def test_files_that_stand_there_are_replaced_only_when_asked(tmp_path: Path) -> None:
    axis, out = tmp_path / "axis.toml", tmp_path / "out"
    axis.write_text(AXIS)
    command = ("plc", axis, "--amplitude", 0.3, "--limit", 2, "--rate", 1000, "--out", out)
    assert livebode(*command).code == 0
    (out / "MAIN.st").write_text("mine")
    done = livebode(*command)
    assert done.code == 2
    assert "exists already; take another --out, or --force to replace it" in done.err
    assert (out / "MAIN.st").read_text() == "mine"
    assert livebode(*command, "--force").code == 0
    assert "mine" not in (out / "MAIN.st").read_text()
    assert sorted(p.name for p in out.iterdir()) == [
        "FB_LivebodeRing.st", "FB_Multisine.st", "FB_SlidingDft.st", "MAIN.st", "ST_LivebodeRing.st",
    ]  # fmt: skip
    done = livebode(*command[:-1], axis)
    assert done.code == 2
    assert "could not be written" in done.err
