"""Whatever arrives: a batch that is what was sent, or one clear sentence. Bounded memory and time.

LIVEBODE_LIVE_FUZZ=1000000 runs so many cases of each parser; the tests run a seeded share.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import struct
import zlib

import numpy as np
import pytest

from livebode.core import Channel, ConfigError, LivebodeError, SourceError, Spectra, SpectraLayout
from livebode.estimation import Settings, SpectraTracker
from livebode.sources.live import (
    FRAME_BYTES_MAX,
    LINE_BYTES_MAX,
    Batch,
    FrameDecoder,
    FrameSplitter,
    LineDecoder,
    LineSplitter,
    Sequencer,
    SourceEvents,
    SourceSettings,
    SpectraBatch,
    check_keys,
    encode_layout,
    encode_line,
    encode_samples,
    encode_spectra,
    encode_spectra_layout,
    parse_address,
)
from livebode.sources.live.framing import HEADER
from livebode.sources.live.spectra_frame import read_spectra_text, spectra_text
from tests.support.damaged_bytes import damaged, one_sentence
from tests.support.errors import refused

CASES = int(os.environ.get("LIVEBODE_LIVE_FUZZ", "10000"))
CHANNELS = (Channel("w", "N m"), Channel("y", "rad/s"))


def batch(first: int = 100, samples: int = 8) -> Batch:
    rng = np.random.default_rng(first)
    return Batch(first, rng.standard_normal((2, samples)), CHANNELS, 4000.0, epoch=5, stamp_s=1.7e9)


def with_crc(raw: bytes) -> bytes:
    """The same bytes with the right length and CRC, so that what lies behind those checks is reached."""
    body = bytearray(raw[:-4])
    if len(body) >= HEADER.size:
        body[8:12] = struct.pack("<I", len(raw))
    return bytes(body) + struct.pack("<I", zlib.crc32(body))


def test_damaged_frames_give_batches_or_a_sentence():
    rng = random.Random(1)
    seeds = [
        encode_layout(CHANNELS, 4000.0, epoch=5),
        encode_samples(batch()),
        encode_samples(batch(), double=True),
        encode_layout([Channel("ä" * 50, "°")], 1.0),
    ]
    decoder, sequencer = FrameDecoder(), Sequencer(SourceEvents())
    decoder.decode(seeds[0])
    decoded = 0
    for _ in range(CASES):
        raw = damaged(rng.choice(seeds), rng)
        raw = with_crc(raw) if rng.random() < 0.7 else raw
        try:
            found = decoder.decode(raw)
        except LivebodeError as error:
            one_sentence(error)
            continue
        if found is not None:
            decoded += 1
            assert found.data.size <= len(raw) / 4
            sequencer.push(found)  # a hostile batch that is well formed must not harm the stream either
    assert decoded > CASES // 100
    assert len(decoder._layouts) <= FrameDecoder.LAYOUTS_MAX
    assert len(sequencer._waiting) + len(sequencer._unconfirmed._batches) < 64


SPECTRA = SpectraLayout(CHANNELS, (Channel("x", "m"),), 400, 20, (2, 4), (3,), (0.5, 0.0), (False, True))


def spectra(first: int = 400, many: int = 3) -> SpectraBatch:
    rng = np.random.default_rng(first)
    sums = rng.standard_normal((2, many, 3)) + 1j * rng.standard_normal((2, many, 3))
    state = np.arange(many, dtype=np.uint32) % 4
    return SpectraBatch(first, sums, rng.standard_normal((1, many)), state, SPECTRA, 4000.0, 5, 1.7e9)


def test_damaged_frames_of_spectra_give_batches_or_a_sentence():
    rng = random.Random(7)
    layout = encode_spectra_layout(SPECTRA, 4000.0, epoch=5)
    decoder, sequencer = FrameDecoder(), Sequencer(SourceEvents(), reorder=0)
    decoder.decode(layout)
    decoder.decode(encode_layout(CHANNELS, 4000.0))
    sequencer.push(spectra(340))
    described = Settings(
        lines=SPECTRA.at(4000.0), output="y", input="w", estimator="direct", schedule="x", hop=SPECTRA.hop
    )
    tracker, decoded, tracked = SpectraTracker(described, SPECTRA), 0, 0
    for case in range(CASES):
        if case % 100 == 0:
            decoder.decode(layout)  # as a sender sends it again and again
        if case % 20 == 0:  # the stream goes on
            now = spectra(400 + 3 * case)
            seeds = [layout, encode_spectra(now), encode_spectra(now, double=True), encode_samples(batch())]
        raw = damaged(rng.choice(seeds), rng)
        raw = with_crc(raw) if rng.random() < 0.7 else raw
        try:
            found = decoder.decode(raw)
        except LivebodeError as error:
            one_sentence(error)
            continue
        if found is None:
            continue
        decoded += 1
        assert found.nbytes <= 2 * len(raw)
        for block in sequencer.push(found):
            # What is well formed goes all the way, whatever numbers it holds.
            assert isinstance(block, Spectra)
            tracked += len(tracker.process(block))
    assert decoded > CASES // 100
    assert tracked > CASES // 100
    assert len(decoder._layouts) <= FrameDecoder.LAYOUTS_MAX
    assert len(sequencer._waiting) + len(sequencer._unconfirmed._batches) < 64


def test_damaged_texts_of_spectra_give_a_layout_or_a_sentence():
    rng = random.Random(8)
    seed = spectra_text(SPECTRA)
    tokens = [
        b"\t",
        b"\n",
        b" ",
        b"signal\t",
        b"value\tx",
        b"-1",
        b"1e999",
        b"nan",
        b"9" * 30,
        "ä".encode(),
        b"\xff",
        b"0",
    ]
    read = 0
    for _ in range(CASES):
        raw = bytearray(seed)
        for _ in range(rng.choice([1, 1, 3])):
            at = rng.randrange(len(raw))
            raw[at : at + rng.randrange(6)] = rng.choice(tokens)
        try:
            found = read_spectra_text(bytes(raw) if rng.random() < 0.5 else damaged(bytes(raw), rng))
        except LivebodeError as error:
            one_sentence(error)
            continue
        read += 1
        assert read_spectra_text(spectra_text(found)) == found
    assert read > CASES // 100


def test_a_stream_of_bytes_finds_its_frames_behind_rubbish():
    rng = random.Random(2)
    for round_ in range(max(20, CASES // 100)):
        frames = [encode_samples(batch(8 * i), sequence=i) for i in range(10)]
        pieces = []
        for frame in frames:
            if rng.random() < 0.5:
                rubbish = rng.randbytes(rng.randrange(200)).replace(b"LBOD", b"    ")
                pieces.append(rng.choice([rubbish, rubbish + b"LBO", b"LBOD" + b"\x07" * 70]))
            pieces.append(frame)
        raw = b"".join(pieces)
        splitter, found = FrameSplitter(), []
        while raw:
            size = rng.choice([1, 3, 50, 1000])
            found += splitter.feed(raw[:size])
            raw = raw[size:]
        assert found == frames, round_
        assert splitter.skipped == sum(map(len, pieces)) - sum(map(len, frames))


def test_damaged_streams_keep_memory_bounded():
    rng = random.Random(3)
    splitter, decoder = FrameSplitter(), FrameDecoder()
    decoder.decode(encode_layout(CHANNELS, 4000.0, epoch=5))
    frame = encode_samples(batch())
    for _ in range(CASES):
        for found in splitter.feed(damaged(frame, rng)):
            with contextlib.suppress(SourceError):
                decoder.decode(found)
        assert len(splitter._bytes) <= FRAME_BYTES_MAX


def test_damaged_lines_give_batches_or_a_sentence():
    rng = random.Random(4)
    seeds = [encode_line(batch()), b'{"sample":1,"data":[[1,null],[2,3e8]]}', b'{"sample":1,"data":[[],[]]}']
    tokens = [
        b"[",
        b"]",
        b"{",
        b"}",
        b'"',
        b",",
        b"null",
        b"1e999",
        b"-1",
        b"NaN",
        b"9" * 400,
        b"true",
        b"\\u0000",
        b":",
    ]
    decoder, decoded = LineDecoder(), 0
    decoder.decode(seeds[0])
    for _ in range(CASES):
        raw = bytearray(rng.choice(seeds))
        if rng.random() < 0.5:
            raw = bytearray(damaged(bytes(raw), rng))
        else:
            at = rng.randrange(len(raw))
            raw[at : at + rng.randrange(4)] = rng.choice(tokens)
        try:
            decoder.decode(bytes(raw))
            decoded += 1
        except LivebodeError as error:
            one_sentence(error)
    assert decoded > CASES // 100


@pytest.mark.parametrize(
    ("line", "code", "facts"),
    [
        (b"[" * 100_000, "line-not-json", {}),
        (b'{"a":' * 100_000, "line-not-json", {}),
        (b"[1]", "line-not-json", {}),
        (b"\xff\xfe", "line-not-json", {}),
        (b'{"sample":1,"data":[["1"]]}', "value-invalid", {"key": "data"}),
        (b'{"sample":1,"data":[[true]]}', "value-invalid", {"key": "data"}),
        (b'{"sample":1,"data":[[1],[1,2]]}', "value-invalid", {"key": "data"}),
        (b'{"sample":1,"data":[[1]]}', "batch-shape", {"channels": 2, "shape": [1, 1]}),
        (b'{"sample":1.5,"data":[[1],[1]]}', "value-invalid", {"key": "sample"}),
        (b'{"sample":-1,"data":[[1],[1]]}', "value-invalid", {"key": "sample"}),
        (b'{"sample":1,"data":[[1],[1]],"rate_hz":"4"}', "value-invalid", {"key": "rate_hz"}),
        (b'{"sample":1,"data":[[1],[1]],"rate_hz":-4}', "value-invalid", {"key": "rate_hz", "value": -4.0}),
        (b'{"sample":1,"data":[[1],[1]],"rate_hz":1' + b"0" * 400 + b"}", "value-invalid", {"key": "rate_hz"}),
        (b'{"sample":1,"data":[[1],[1' + b"0" * 400 + b"]]}", "value-invalid", {"key": "data"}),
        (b'{"sample":1,"data":[[1],[1]],"smaple":1}', "key-unknown", {"key": "smaple"}),
        (b'{"data":[[1]]}', "key-missing", {"key": "sample"}),
        (b'{"sample":1,"data":[[1],[1]],"channels":["w","w"]}', "channels-invalid", {}),
        (b'{"sample":1,"data":[[1],[1]],"channels":["w","\\n"]}', "channels-invalid", {"channel": ""}),
        (b" " * (LINE_BYTES_MAX + 1), "line-too-long", {"limit_bytes": LINE_BYTES_MAX}),
        (b'{"sample":1,"data":[[' + b"1," * (1 << 20) + b"1],[]]}", "value-invalid", {"key": "data"}),
    ],
)
def test_lines_that_are_refused(line, code, facts):
    decoder = LineDecoder()
    decoder.decode(encode_line(batch()))
    with refused(SourceError, code, **facts):
        decoder.decode(line)


@pytest.mark.parametrize(("more", "key"), [({}, "channels"), ({"channels": ["w"]}, "rate_hz")])
def test_a_first_line_without_channels_or_rate_is_refused(more, key):
    with refused(SourceError, "key-missing", key=key):
        LineDecoder().decode(json.dumps({"sample": 1, "data": [[1]], **more}).encode())


def test_a_line_without_end_does_not_fill_the_memory():
    splitter = LineSplitter()
    for _ in range(3 * LINE_BYTES_MAX // 65536):
        assert splitter.feed(b"x" * 65536) == []
        assert sum(map(len, splitter._parts)) <= LINE_BYTES_MAX
    assert splitter.feed(b'\n{"sample":1}\n') == [b'{"sample":1}']
    assert splitter.cut == 1


def test_lines_are_cut_anywhere_alike():
    rng = random.Random(5)
    lines = [json.dumps({"sample": i}).encode() for i in range(50)]
    raw = b"\n".join(lines)
    for _ in range(max(20, CASES // 100)):
        splitter, found, at = LineSplitter(), [], 0
        while at < len(raw):
            size = rng.randrange(1, 30)
            found += splitter.feed(raw[at : at + size])
            at += size
        assert found + splitter.feed(b"") == lines


FRAME = encode_spectra(spectra())


def changed(at: int, new: bytes) -> bytes:
    """The frame of spectra with other bytes from `at` on."""
    return with_crc(FRAME[:at] + new + FRAME[at + len(new) :])


@pytest.mark.parametrize(
    ("frame", "code", "facts"),
    [
        (changed(24, struct.pack("<Q", 420)), "spectrum-misplaced", {"sample": 420, "hop": 20}),
        (changed(24, struct.pack("<Q", 2**64 - 1)), "value-invalid", {"key": "first_sample"}),
        (changed(24, struct.pack("<Q", 0)), "value-invalid", {"key": "first_sample", "value": -19}),
        (changed(40, struct.pack("<d", 0.0)), "value-invalid", {"key": "rate_hz", "value": 0.0}),
        (changed(40, struct.pack("<d", float("nan"))), "value-invalid", {"key": "rate_hz"}),
        (changed(52, struct.pack("<H", 4)), "frame-inconsistent", {"channels": [4, 3]}),
        (changed(54, struct.pack("<H", 4)), "frame-inconsistent", {"spectra": 4, "bytes": 168}),
        (changed(54, struct.pack("<H", 0)), "frame-inconsistent", {"spectra": 0}),
        (changed(56, struct.pack("<I", 4)), "value-invalid", {"key": "state", "value": 4}),
    ],
)
def test_spectra_that_are_refused(frame, code, facts):
    decoder = FrameDecoder()
    decoder.decode(encode_spectra_layout(SPECTRA, 4000.0))
    with refused(SourceError, code, **facts):
        decoder.decode(frame)


@pytest.mark.parametrize(
    ("old", "new", "code", "facts"),
    [
        (b"window\t400\n", b"", "layout-invalid", {"word": "window"}),
        (b"window\t400\n", b"window\t400\nwindow\t400\n", "layout-invalid", {"word": "window"}),
        (b"hop\t20", b"hop\t20\t5", "layout-invalid", {"word": "hop"}),
        (b"400", b"4e2", "layout-invalid", {"word": "window"}),
        (b"2 4", b"2  4", "layout-invalid", {"word": "lines"}),
        (b"lines", b"line", "layout-invalid", {"word": "line"}),
        (b"\t0.5", b"\tnan", "layout-invalid", {"word": "signal"}),
        (b"differenced", b"differential", "layout-invalid", {"word": "signal"}),
        (b"rad/s\t0\tdifferenced", b"rad/s\t0\tdifferenced\tx", "layout-invalid", {"word": "signal"}),
        (b"value\tx\tm", b"value\tx\tm\t1", "layout-invalid", {"word": "value"}),
        (b"value\tx", b"value\t", "channels-invalid", {"channel": ""}),
        (b"\tx\tm", b"\tx\t\xff", "layout-invalid", {}),
    ],
)
def test_texts_of_spectra_that_are_refused(old, new, code, facts):
    text = spectra_text(SPECTRA)
    assert old in text
    with refused(SourceError, code, **facts):
        read_spectra_text(text.replace(old, new, 1))


def test_a_value_with_the_name_of_a_signal_is_refused():
    with pytest.raises(LivebodeError) as caught:
        read_spectra_text(spectra_text(SPECTRA).replace(b"value\tx", b"value\ty"))
    one_sentence(caught.value)


def test_spectra_without_their_layout_are_dropped():
    decoder = FrameDecoder()
    decoder.decode(encode_layout(CHANNELS, 4000.0))
    assert decoder.decode(FRAME) is None


@pytest.mark.parametrize(
    ("frame", "code", "facts"),
    [
        (b"", "frame-damaged", {"bytes": 0}),
        (b"HTTP/1.1 200 OK" * 10, "frame-damaged", {"beginning": b"HTTP".hex()}),
        (encode_samples(batch())[:-1], "frame-damaged", {"bytes": len(encode_samples(batch())) - 1}),
        (encode_samples(batch())[:-4] + b"\0\0\0\0", "frame-damaged", {}),
        (with_crc(b"LBOD\x02" + encode_samples(batch())[5:]), "frame-unsupported", {"version": 2}),
        (with_crc(b"LBOD\x01\x05" + encode_samples(batch())[6:]), "frame-unsupported", {"frame_kind": 5}),
        (with_crc(b"LBOD\x01\x01\x80" + encode_samples(batch())[7:]), "frame-unsupported", {"flags": 128}),
        (
            with_crc(encode_samples(batch())[:54] + b"\x07\x00" + encode_samples(batch())[56:]),
            "frame-inconsistent",
            {"samples": 7},
        ),
        (with_crc(encode_layout(CHANNELS, 1.0)[:-4] + b"x\n" + b"    "), "frame-inconsistent", {}),
    ],
)
def test_frames_that_are_refused(frame, code, facts):
    decoder = FrameDecoder()
    decoder.decode(encode_layout(CHANNELS, 4000.0))
    with refused(SourceError, code, **facts):
        decoder.decode(frame)


URLS = [
    "udp://0.0.0.0:5000", "tcp://plc:1", "mqtt://broker/a/b", "mqtts://[::1]:8883/x", "opc.tcp://h:4840/server", "ads://h",
    "stdin:", "serial:/dev/ttyACM0", "serial:COM3", "can:socketcan/can0", "hal:sampler.0",
]  # fmt: skip


def test_damaged_addresses_give_an_address_or_a_sentence():
    rng = random.Random(6)
    for _ in range(CASES):
        url = damaged(rng.choice(URLS).encode(), rng).decode("utf-8", "replace")
        try:
            address = parse_address(url)
        except LivebodeError as error:
            one_sentence(error)
        else:
            assert parse_address(str(address)) == address


@pytest.mark.parametrize(
    "url",
    [
        "http://h:1/hunter2", "udp://:5000", "udp://h", "udp://h:99999", "tcp://h:1/hunter2", "mqtt://h?x=hunter2",
        "5000", "udp://h:1\n", "mqtt://me:hunter2", "mqtt://me:hunter2%40h/t", "mqtt://h#hunter2", "hunter2",
        "serial:", "serial:///", "can:can0",
    ],
)  # fmt: skip
def test_addresses_that_are_refused_are_not_repeated(url):
    with refused(ConfigError, "value-invalid", key="source.url"):
        parse_address(url)
    with pytest.raises(ConfigError) as caught:
        parse_address(url)
    assert "hunter2" not in repr(caught.value.as_dict()) + str(caught.value)


def test_a_password_in_the_url_is_refused_and_not_repeated():
    with pytest.raises(ConfigError) as caught:
        parse_address("mqtt://user:hunter2@broker/topic")
    assert (caught.value.code, caught.value.key) == ("config.secret-in-url", "source.url")
    assert "hunter2" not in repr(caught.value.as_dict())
    assert "password_env" in caught.value.remedy


def test_a_key_of_another_kind_of_source_is_refused():
    settings = SourceSettings(url="udp://h:1", nodes={"w": "ns=2;s=w"})
    allowed = ["fields", "rate_hz", "reorder_batches", "sample_field", "sender", "url"]
    with refused(ConfigError, "key-unused", key="source.nodes", source="udp", allowed=allowed):
        check_keys(settings, "udp")
