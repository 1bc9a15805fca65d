"""Every generated text parses, keeps to the subset and computes what it should, whatever its settings."""

from __future__ import annotations

import os
import string

import numpy as np
import pytest
from blark.parse import parse as parse_file
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st

from livebode.core import Lines
from livebode.excitation import function_block
from livebode.kernel import SlidingDFT
from livebode.structured_text import NAME_LENGTH_MAX, as_name, check_name
from livebode_drives.live.ads import HEADER, read_ring
from livebode_drives.structured_text.project import Project, ring_block, ring_type
from livebode_drives.structured_text.sliding_dft import sliding_dft
from livebode_drives.structured_text.twincat import twincat
from tools.structured_text import Machine, parse

EXAMPLES = int(os.environ.get("LIVEBODE_PLC_EXAMPLES", "2"))
"""A text of the sliding DFT takes blark two seconds; `make fuzz` takes more of them."""
few = settings(
    max_examples=EXAMPLES,
    deadline=None,
    suppress_health_check=list(HealthCheck),
    phases=[Phase.explicit, Phase.generate],  # to shrink would take many more
)

raw_names = st.text(string.ascii_letters + string.digits + "_ []/äµ-", min_size=1, max_size=40)
names = raw_names.map(as_name)


def channel_names(most: int) -> st.SearchStrategy[list[str]]:
    """Names that do not clash with each other or with the blocks' own."""
    return st.lists(names.map(lambda name: f"c_{name}"[:NAME_LENGTH_MAX].rstrip("_")), min_size=1, max_size=most).map(
        lambda found: list({name.lower(): name for name in found}.values())
    )


@st.composite
def line_sets(draw: st.DrawFn) -> Lines:
    window = draw(st.integers(3, 64))
    bins = draw(st.sets(st.integers(1, (window - 1) // 2), min_size=1, max_size=4))
    return Lines(tuple(bins), window, rate_hz=draw(st.floats(1.0, 1e5)))


@few
@given(
    line_sets(), channel_names(3), names.map(lambda n: f"FB_{n}"[:32].rstrip("_")), st.sampled_from(["fixed", "window"])
)
def test_a_sliding_dft_of_any_settings_is_the_kernel(lines, channels, name, phase) -> None:
    dft = Machine(sliding_dft(lines, channels, name=name, phase=phase)).instance(name)
    for _ in range(lines.window):
        dft()
    x = np.random.default_rng(0).standard_normal((len(channels), 3 * lines.window))
    expected = SlidingDFT(lines.window, list(lines.bins), channels=len(channels)).process(x, phase=phase)
    for n, sample in enumerate(x.T.tolist()):
        dft(**dict(zip(channels, sample)))
        np.testing.assert_array_equal(dft["re"], expected[:, n].real)
        np.testing.assert_array_equal(dft["im"], expected[:, n].imag)


@few
@given(
    st.lists(st.floats(-1e300, 1e300, allow_nan=False), min_size=2, max_size=12).filter(any),
    st.integers(1, 3),
    st.text(max_size=40),
)
@example([5e-324, -1.0, 1e-7, 123456.0], 1, "(* \n *) ; // END_VAR ]]>")
def test_a_period_of_any_numbers_is_played_to_the_bit(period, ramp_periods, note) -> None:
    text = function_block(period, rate_hz=1e3, limit=max(map(abs, period)), ramp_periods=ramp_periods, note=note)
    block = Machine(text).instance("FB_Multisine")
    played = []
    for _ in range((3 + ramp_periods) * len(period)):
        block(enable=True)
        if block["steady"]:
            played.append(block["w"])
    np.testing.assert_array_equal(played, np.resize(period, len(played)))
    assert len(played) >= len(period)
    assert not block["limited"]


@settings(max_examples=4 * EXAMPLES, deadline=None)
@given(channel_names(6), st.integers(2, 50), st.floats(1e-3, 1e6), st.integers(1, 70), st.booleans())
def test_a_ring_of_any_settings_is_what_livebode_reads(channels, length, rate_hz, cycles, clock) -> None:
    machine = Machine(ring_type(len(channels), rate_hz, length=length), ring_block(channels, length=length))
    ring, block = machine.instance("ST_LivebodeRing"), machine.instance("FB_LivebodeRing")
    written = np.random.default_rng(cycles).standard_normal((cycles, len(channels)))
    for n, row in enumerate(written.tolist()):
        block(ring=ring.memory, stamp=(2**63 + n) * clock, **dict(zip(channels, row)))
    raw = ring.bytes()
    found, dtype = read_ring(raw, len(raw))
    assert (found.channels, found.length, found.rate_hz, found.count) == (len(channels), length, rate_hz, cycles)
    assert found.stamp == (2**63 + cycles - 1) * clock
    assert (found.epoch > 0) == clock
    rows = np.frombuffer(raw, dtype, offset=HEADER.size).reshape(length, len(channels))
    for number in range(max(0, cycles - length), cycles):
        np.testing.assert_array_equal(rows[number % length], written[number])


@given(raw_names)
@example("__")
@example("limit")
@example("To_LREAL")
@example("_1")
def test_the_name_that_is_proposed_would_do(text: str) -> None:
    proposed = as_name(text)
    check_name(proposed, "channel")
    assert as_name(proposed) == proposed
    assert as_name(text, taken=[proposed.upper()]).lower() != proposed.lower()


@settings(max_examples=8 * EXAMPLES, deadline=None)
@given(names)
def test_a_name_that_is_taken_is_one_to_the_parser(name: str) -> None:
    parse(f"PROGRAM P\nVAR\n    {name} : LREAL;\nEND_VAR\n{name} := {name} + 1.0;\nEND_PROGRAM\n")


@pytest.mark.parametrize("name", ["FB_LivebodeRing", "ST_LivebodeRing", "MAIN"])
def test_twincat_files_hold_the_same_text(name: str, tmp_path) -> None:
    lines = Lines((1,), 4, rate_hz=1e3)
    files = Project([1.0, 0.0, 0.0, 0.0], 1.0, lines, ["w", "y"], "w", ["w", "y"]).files()
    file, content = twincat(files[f"{name}.st"])
    (tmp_path / file).write_text(content)
    parts = list(parse_file(tmp_path / file))
    assert parts
    for part in parts:
        assert part.exception is None
    words = " ".join(part.source_code for part in parts).split()
    assert [w for w in words if not w.startswith("END_")] == [
        w for w in files[f"{name}.st"].split() if not w.startswith("END_")
    ]
