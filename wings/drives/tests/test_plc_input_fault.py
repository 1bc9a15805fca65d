"""What Structured Text or a PLC cannot take is refused, with the value and what would do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from livebode.core import Lines, UsageError
from livebode.excitation import function_block
from livebode_drives.structured_text.project import Project, ring_block, ring_type
from livebode_drives.structured_text.sliding_dft import sliding_dft
from tests.support.command import livebode
from tests.support.errors import refused

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
    ("name", "code", "nearest"),
    [
        ("motor velocity", "invalid-name", "motor_velocity"),
        ("2nd", "invalid-name", "x2nd"),
        ("Limit", "invalid-name", "Limit_1"),
        ("END_IF", "invalid-name", "END_IF_1"),
        ("udint_to_lreal", "invalid-name", "udint_to_lreal_1"),
        ("a__b", "invalid-name", "a_b"),
        ("a_", "invalid-name", "a"),
        ("x" * 33, "invalid-name", "x" * 32),
        ("φ", "invalid-name", "x"),
        ("", "invalid-name", "x"),
        ("Count", "duplicate", "Count_1"),
        ("U", "duplicate", "U_1"),
    ],
)
def test_a_channel_name_that_structured_text_forbids_is_refused_with_the_nearest_allowed_one(
    name: str, code: str, nearest: str
) -> None:
    with refused(UsageError, code, value=name, element="channel", nearest=nearest):
        sliding_dft(LINES, ["u", name])


def test_every_kind_of_name_is_held_to_the_same() -> None:
    for make in (
        lambda: sliding_dft(LINES, ["u"], name="FB__Dft"),
        lambda: function_block(PERIOD, rate_hz=1e3, limit=2, name="FB__Multisine"),
        lambda: ring_type(1, 1e3, name="ST__Ring"),
        lambda: ring_block(["u"], name="FB__Ring"),
        lambda: ring_block(["u"], type_name="ST__Ring"),
        lambda: Project(PERIOD, 2.0, LINES, ["w", "u"], "w", ["w", "u"], counter="s__n").files(),
    ):
        with refused(UsageError, "invalid-name"):
            make()
    with refused(UsageError, "duplicate", value="stamp"):
        ring_block(["stamp"])
    with refused(UsageError, "duplicate", value="fbring"):
        Project(PERIOD, 2.0, LINES, ["w", "fbring"], "w", ["w"]).files()


@pytest.mark.parametrize(
    ("period", "given", "code", "facts"),
    [
        (PERIOD, {"limit": 1.2}, "conflict", {"argument": "limit", "peak": 1.5, "scale_max": 0.7996}),
        (PERIOD, {"limit": 0.0}, "out-of-range", {"argument": "limit", "value": 0.0}),
        (PERIOD, {"limit": np.inf}, "out-of-range", {"argument": "limit", "value": np.inf}),
        (PERIOD, {"limit": np.nan}, "out-of-range", {"argument": "limit"}),
        (PERIOD, {"rate_hz": 0.0}, "out-of-range", {"argument": "rate_hz", "value": 0.0}),
        (PERIOD, {"ramp_periods": 0}, "out-of-range", {"argument": "ramp_periods", "value": 0}),
        ([0.0, 0.0], {}, "out-of-range", {"argument": "period", "value": 0.0}),
        ([1e-320, 0.0], {}, "out-of-range", {"argument": "period", "value": 1e-320}),
        ([1.0, np.nan], {}, "not-finite", {"argument": "period", "sample": 1}),
        (np.ones(16385), {}, "wrong-shape", {"argument": "period", "shape": [16385]}),
        ([[1.0, 2.0]], {}, "wrong-shape", {"argument": "period", "shape": [1, 2]}),
    ],
)
def test_an_excitation_that_no_block_can_play_is_refused(
    period, given: dict[str, float], code: str, facts: dict
) -> None:
    with refused(UsageError, code, **facts):
        function_block(period, **({"rate_hz": 1e3, "limit": 2.0} | given))


sizes = st.floats(1e-100, 1e100)


@settings(deadline=None)
@given(st.lists(st.floats(-1.0, 1.0, width=32), min_size=2, max_size=8).filter(any), sizes, sizes)
@example([0.0, 1.0, -1.0], 1.5, 1.2)
@example([1.0, 0.5], 35.6326, 2.0)
def test_the_scale_that_a_refusal_names_passes_and_a_larger_one_by_a_thousandth_does_not(shape, size, limit) -> None:
    period = np.array(shape) * size
    try:
        function_block(period, rate_hz=1e3, limit=limit)
    except UsageError as error:
        scale = error.scale_max
        assert function_block(period * scale, rate_hz=1e3, limit=limit)
        with refused(UsageError, "conflict", argument="limit"):
            function_block(period * scale * 1.002, rate_hz=1e3, limit=limit)


def test_blocks_too_large_for_a_plc_are_refused_with_the_largest_that_fits() -> None:
    with refused(UsageError, "too-large", samples=1_000_000, samples_max=349_523, limit_bytes=8_388_608):
        sliding_dft(Lines((1,), 1_000_000, rate_hz=1e3), ["u"])
    assert sliding_dft(Lines((1,), 349_523, rate_hz=1e3), ["u"])
    with refused(UsageError, "too-large", samples=300_000, samples_max=262_142):
        ring_type(4, 1e3, length=300_000)
    assert ring_type(4, 1e3, length=262_142)
    with refused(UsageError, "out-of-range", argument="length", value=1):
        ring_block(["u"], length=1)
    with refused(UsageError, "out-of-range", argument="channels", value=[]):
        sliding_dft(LINES, [])
    with refused(UsageError, "out-of-range", argument="channels", value=65):
        ring_type(65, 1e3)
    with refused(UsageError, "out-of-range", argument="rate_hz"):
        ring_type(1, np.nan)
    with refused(UsageError, "not-one-of", argument="phase", value="sideways"):
        sliding_dft(LINES, ["u"], phase="sideways")
    with refused(UsageError, "unknown-name", argument="tracked", value="z", allowed=["w", "u"]):
        Project(PERIOD, 2.0, LINES, ["w", "u"], "w", ["z"]).files()


@pytest.mark.parametrize(
    ("change", "more", "message"),
    [
        (("", ""), ("--rate", 0), "rate"),
        (("", ""), (), "the rate of the PLC task is missing"),
        (('excitation = "w"', ""), ("--rate", 1000), "signals.excitation is missing"),
        (("window = 20", ""), ("--rate", 1000), "lines or window are 'auto'"),
        (('"100, 200"', '"100, 600"'), ("--rate", 1000), "600 Hz is not between 0 and the Nyquist frequency 500 Hz"),
        (('"100, 200"', '"110"'), ("--rate", 1000), "nearest lines are 100 and 150 Hz"),
        (('output = "y"', 'output = "z"'), ("--rate", 1000), "there is no channel 'z'; choose from w, y"),
        (('"w [N m]"', '"two words"'), ("--rate", 1000), "there is no channel 'w'"),
        (("", ""), ("--rate", 1000, "--limit", 0.1), "exceeds limit=0.1; scale it by at most"),
        (("", ""), ("--rate", 1000, "--amplitude", "nan"), "amplitude=nan is not a finite number"),
        (("", ""), ("--rate", 1000, "--ring", 1), "too short"),
    ],
)
def test_the_command_refuses_in_a_sentence_and_writes_nothing(change, more, message: str, tmp_path: Path) -> None:
    axis, out = tmp_path / "axis.toml", tmp_path / "out"
    axis.write_text(AXIS.replace(*change) if change[0] else AXIS)
    done = livebode("plc", axis, "--amplitude", 0.3, "--limit", 2, *more, "--out", out)
    assert done.code == 2
    assert message in done.err
    assert not out.exists()


def test_files_that_stand_there_are_replaced_only_when_asked(tmp_path: Path) -> None:
    axis, out = tmp_path / "axis.toml", tmp_path / "out"
    axis.write_text(AXIS)
    command = ("plc", axis, "--amplitude", 0.3, "--limit", 2, "--rate", 1000, "--out", out)
    assert livebode(*command).code == 0
    (out / "MAIN.st").write_text("mine")
    done = livebode(*command)
    assert done.code == 2
    assert "exists already; choose another --out, or replace it with --force" in done.err
    assert (out / "MAIN.st").read_text() == "mine"
    assert livebode(*command, "--force").code == 0
    assert (out / "MAIN.st").read_text() == "mine"
    assert sorted(p.name for p in out.iterdir()) == [
        "FB_LivebodeRing.st", "FB_Multisine.st", "FB_SlidingDft.st", "MAIN.new.st", "MAIN.st", "ST_LivebodeRing.st",
    ]  # fmt: skip
    done = livebode(*command[:-1], axis)
    assert done.code == 2
    assert "could not be written" in done.err
