"""Messages of another program are listed, their fields are proposed, and their numbers are the samples of a source."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from itertools import repeat
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import ConfigError, SourceError
from livebode.sources.live import FieldDecoder, SourceSettings, make_source, open_source, survey
from livebode.sources.live.fields import number_fields, numbers_at
from tests.support.command import livebode, signals
from tests.support.foreign import FIELDS, messages, tcp_sender, udp_sender
from tests.support.peers.peer import free_port

NAMES = st.text(st.characters(categories=("L", "N"), include_characters="_-:"), min_size=1, max_size=8)
NUMBERS = st.integers(-1000, 1000).map(float)
VALUES = st.recursive(
    NUMBERS | st.lists(NUMBERS, min_size=1, max_size=4),
    lambda inner: st.dictionaries(NAMES, inner, max_size=4) | st.lists(inner, min_size=1, max_size=3),
    max_leaves=12,
)


@given(st.dictionaries(NAMES, VALUES, max_size=4))
def test_each_listed_field_is_found_by_its_path(message: dict) -> None:
    for path, numbers in number_fields(message):
        assert numbers_at(path, message) == numbers


@pytest.fixture(params=["udp", "tcp"])
def url(request: pytest.FixtureRequest) -> Iterator[str]:
    if request.param == "tcp":
        with tcp_sender(messages()) as port:
            yield f"tcp://127.0.0.1:{port}"
    else:
        port = free_port()
        with udp_sender(port, messages()):
            yield f"udp://127.0.0.1:{port}"


def test_the_fields_are_listed_and_the_configuration_of_them_is_that_of_the_machine(url: str, tmp_path: Path) -> None:
    shown = livebode("inspect", url, "--json")
    listed = {channel["name"] for channel in json.loads(shown.out)["channels"]}
    assert listed == {"ts", "n", "drive.enabled", *FIELDS.values()}
    out = tmp_path / "axis.toml"
    result = livebode("inspect", url, "--out", out, "--yes", "--rate", 1000)
    assert result.code == 0, result.err
    table = tomllib.loads(out.read_text())
    assert table["source"] == {"url": url, "rate_hz": 1000.0, "sample_field": "n", "fields": FIELDS}
    assert table["signals"] == {"excitation": "torque_inject", "input": "torque_actual", "output": "vel"}
    assert table["lines"] == {"frequencies": "50, 100, 200", "window": 20}


def test_the_samples_of_a_source_are_the_numbers_of_the_fields(url: str) -> None:
    settings = SourceSettings(url=url, rate_hz=1000.0, fields={"y [rad/s]": FIELDS["vel"]}, sample_field="n")
    with open_source(settings) as source:
        assert [(channel.name, channel.unit) for channel in source.channels] == [("y", "rad/s")]
        block = next(block for block in source.blocks() if len(block))
    first = source.first_sample
    expected = np.resize(signals()["y"], 100_000)[first : first + len(block)]
    assert np.array_equal(block["y"], expected)


def test_a_lost_message_is_a_gap_by_the_field_that_numbers_and_without_it_is_not_noticed() -> None:
    lines = list(zip(range(3), messages()))
    numbered = FieldDecoder({"y": FIELDS["vel"]}, 1000.0, "n")
    counted = FieldDecoder({"y": FIELDS["vel"]}, 1000.0)
    numbers = [[decoder.decode(lines[i][1]).first_sample for i in (0, 2)] for decoder in (numbered, counted)]
    assert numbers == [[0, 20], [0, 10]]


@pytest.mark.parametrize(
    ("payload", "says"),
    [
        (b"12.5;13.5", r"it sends no JSON|not JSON"),
        (b'{"drive": "X20"}', "no field 'axes\\[0\\].vel'"),
        (b'{"axes": [{"vel": "fast"}]}', "'axes\\[0\\].vel' of a message is not a number"),
        (b'{"axes": [{"v": 1}]}', "no field 'axes\\[0\\].vel'; name one of axes\\[0\\].v"),
    ],
)
def test_a_message_without_the_fields_is_a_sentence_that_names_those_it_has(payload: bytes, says: str) -> None:
    with pytest.raises(SourceError, match=says):
        FieldDecoder({"y": "axes[0].vel"}, 1000.0).decode(payload)


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"fields": {"y": "a..b"}, "rate_hz": 1.0}, "the path 'a..b' in source.fields cannot be read"),
        ({"fields": {"y": "a.b"}}, "source.fields needs source.rate_hz"),
        ({"sample_field": "n"}, "source.sample_field needs source.fields"),
    ],
)
def test_settings_that_are_not_complete_are_refused(keys: dict, says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        make_source(SourceSettings(url="udp://127.0.0.1:5000", **keys))


def test_of_messages_that_are_no_json_the_survey_shows_the_first_bytes() -> None:
    port = free_port()
    with udp_sender(port, repeat(b"12.5;13.5;rpm")):
        found = survey(f"udp://127.0.0.1:{port}", 1.0)
    assert not found.channels
    assert "the newest has 13 bytes and begins with b'12.5;13.5;rpm'" in found.trouble


def test_a_silent_port_is_one_sentence() -> None:
    result = livebode("inspect", f"udp://127.0.0.1:{free_port()}")
    assert result.code != 0
    assert result.err.count("\n") == 1
    assert "no samples arrived within 3 s (nothing was received)" in result.err


def test_of_messages_that_cannot_be_used_no_remedy_is_what_was_just_tried(tmp_path: Path) -> None:
    port = free_port()
    url = f"udp://127.0.0.1:{port}"
    with udp_sender(port, repeat(b"12.5;13.5;rpm")):
        listed = livebode("inspect", url, "--out", tmp_path / "mine.toml", "--yes")
        with pytest.raises(SourceError) as caught, open_source(SourceSettings(url=url, timeout_s=1.0)):
            pass
    assert caught.value.remedy == "compare the sender with [source]"
    assert (listed.code, listed.err.count(url)) == (75, 1)
    assert "the newest has 13 bytes and begins with b'12.5;13.5;rpm'" in listed.err
    for wrong in ("livebode inspect", "machine is on", "Error"):
        assert wrong not in listed.err


def test_a_recording_is_not_at_the_address_of_a_live_source_and_the_sentence_says_where_it_begins() -> None:
    result = livebode("run", "mqtt://127.0.0.1/hall/press3", "--output", "y")
    assert "it is a live source: write its configuration by livebode inspect mqtt://127.0.0.1/hall/press3 --out" in (
        result.err
    )
