"""Computed channels equal NumPy's, with their units; a name in the file wins; the grammar is closed."""

from __future__ import annotations

import contextlib
import re
import string
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import Channel, RecordingError, UsageError
from livebode.sources import Log, open_log
from livebode.sources.expressions import DEPTH_MAX, ExpressionSyntaxError, parse_expression
from tests.support.command import write_parquet
from tests.support.errors import refused

RATE_HZ = 1000
_RNG = np.random.default_rng(3)
A, B, C = _RNG.standard_normal((3, 500))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    columns = {"a [m]": A, "b [m]": B, "angle [rad]": C, "a-b": A + 7, "enc 1 (mm)": A, "s.v": B, "n": C}
    return open_log(write_parquet(tmp_path_factory.mktemp("log") / "log.parquet", columns), rate_hz=RATE_HZ)


def read(log: Log, name: str) -> tuple[np.ndarray, Channel]:
    blocks = list(log.blocks([name], 64))
    return np.concatenate([block[name] for block in blocks]), blocks[0].channels[0]


def slope(x: np.ndarray) -> np.ndarray:
    return np.diff(x) * RATE_HZ


@pytest.mark.parametrize(
    ("text", "values", "unit", "kind"),
    [
        ("-a", -A, "m", "position"),
        ("a + 0.35*angle", A + 0.35 * C, "m", "position"),
        ("(a - b)/2", (A - B) / 2, "m", "position"),
        ("diff(a)", slope(A), "m/s", "velocity"),
        ("diff(diff(angle))", slope(slope(C)), "rad/s²", "acceleration"),
        ("angle + diff(angle)*0.001", C[1:] + slope(C) * 0.001, "rad", "position"),
        ("a/b", A / B, "", "other"),
        ("n*angle", C * C, "", "other"),
        ("a*b", A * B, "m m", "other"),
        ("1/a", 1 / A, "1/(m)", "other"),
        ("2*`enc 1`", 2 * (A * 1e-3), "m", "position"),
        ("2*a [mm]", 2 * A * 1e-3, "m", "position"),
        ("-s.v", -B, "", "other"),
        ("+a - -3e2", A + 300, "m", "position"),
        ("a-b", A + 7, "", "other"),  # a column of this name
        ("a -b", A - B, "m", "position"),
    ],
)
def test_a_computed_channel_has_the_values_of_numpy_and_its_unit(
    log: Log, text: str, values: np.ndarray, unit: str, kind: str
) -> None:
    found, channel = read(log, text)
    assert np.array_equal(found, values)
    assert (channel.name, channel.unit, channel.kind) == (text, unit, kind)
    assert log.naming([text]).channels[-1 if text != "a-b" else 3] == channel


def test_a_difference_begins_again_behind_a_gap_and_is_whole_in_a_part(tmp_path: Path) -> None:
    numbers = np.concatenate([np.arange(100), np.arange(103, 300)])
    x = _RNG.standard_normal(300)
    log = open_log(write_parquet(tmp_path / "gap.parquet", {"t": numbers / RATE_HZ, "x": x[numbers]}), rate_hz=RATE_HZ)
    for part, starts in ((log, {1, 104}), (log.part(50), {50, 104}), (log.part(104, 200), {104})):
        blocks = list(part.blocks(["diff(x)", "x"], 17))
        assert starts == {block.start for block in blocks if block.gap or block is blocks[0]}
        for block in blocks:
            at = np.arange(block.start, block.stop)
            assert np.array_equal(block["x"], x[at])
            assert np.allclose(block["diff(x)"], (x[at] - x[at - 1]) * RATE_HZ, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("-enc9", "there is no channel 'enc9'; did you mean"),
        ("a + nothing", "there is no channel 'nothing'"),
        ("a +", "it is not of the form a - 0.5*b"),
        ("a**2", "only names, numbers, + - * /, diff(…) and unwrap(…, turn) are possible"),
        ("abs(a)", "only names"),
        ("a[0]*2", "only names"),
        ("a + True", "only names"),
        ("__import__('os').system('x')", "only names"),
        ("a + (lambda: 1)()", "only names"),
        ("2*3", "there is no channel in it"),
        ("1e999*a", "a number in it is too large"),
        ("-" * (DEPTH_MAX + 2) + "a", f"nested more than {DEPTH_MAX} deep"),
        ("(" * 90 + "a" + ")" * 90 + "-" * 90, "it is not an expression"),
        ("+".join("a" * 150), "longer than 200 characters"),
    ],
)
def test_what_is_not_in_the_grammar_is_refused_by_one_sentence(log: Log, text: str, words: str) -> None:
    with pytest.raises(RecordingError, match=re.escape(words)) as caught:
        log.blocks([text])
    assert (caught.value.code, str(caught.value).count("\n")) == ("recording.channel-unknown", 0)


def test_different_units_without_a_factor_between_them_are_refused(log: Log) -> None:
    with refused(UsageError, "conflict", units=["m", "rad"]):
        log.blocks(["a + angle"])


@given(st.text(st.sampled_from(string.ascii_letters + string.digits + "+-*/(). `[]_,:'\"\\\n\0=λ"), max_size=60))
def test_any_text_is_an_expression_or_refused(text: str) -> None:
    try:
        found = parse_expression(text)
    except ExpressionSyntaxError:
        return
    data = {name: np.ones(3) for name in found.names}
    assert found.values(data, 10.0).shape == (3,)
    with contextlib.suppress(UsageError):  # units that differ
        found.channel({name: Channel(name, "m") for name in found.names})
