"""Whatever a configuration holds: axes that can be made, or one clear sentence. Bounded memory and time.

LIVEBODE_CONFIGURATION_FUZZ=1000000 runs so many cases; the tests run a seeded share.
"""

from __future__ import annotations

import os
import random
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from livebode.configuration import Axis, ConfigurationFile, axes_of, chosen_model, fitter_of
from livebode.configuration.toml_file import FILE_BYTES_MAX
from livebode.core import ConfigError, LivebodeError, PlantKinds
from livebode.preparation import live_follower
from tests.support.errors import refused

CASES = int(os.environ.get("LIVEBODE_CONFIGURATION_FUZZ", "2000"))
GROWN_BYTES_MAX = 100 << 20
RATE_HZ = 4000.0
WHOLE = """
[source]
url = "udp://127.0.0.1:5000"
rate_hz = 4000
reorder_batches = 8
[signals]
output = "y"
input = "u"
excitation = "w"
schedule = "x"
[lines]
frequencies = "20:140:20"
window = 400
[tracking]
estimator = "joint"
quantity = "plant"
hop = 20
average = false
forgetting = 0.8
noise = "periods"
differenced = ["y"]
spikes = ["u"]
hann = false
dtype = "float64"
[monitoring]
false_alarm_interval_days = 30.0
[loop]
excitation_at = "plant input"
entry_gain = 1.0
[loop.velocity]
gain = 0.2308
integral_time_s = 0.2
rate_hz = 4000
rate_divider = 1
[loop.position]
gain = 1.0
rate_hz = 2000
rate_divider = 2
[fit]
model = "two-mass"
radius_m = 0.019
fixed = { Js = 0.0028 }
free = ["delay"]
band_hz = [30, 120]
[record]
samples = true
budget_bytes = 20000000
segment_s = 300.0
[axes.x.source]
url = "tcp://127.0.0.1:5001"
[axes.x.lines]
window = 800
[axes.y.tracking]
hop = 40
"""
ODD = [
    "nan", "inf", "-inf", "0", "-1", "1e308", "-1e-308", "5e-324", "9223372036854775808", "-" + "9" * 40, "1" * 5000,
    "true", "[]", "{}", "[[]]", "[{}, 1]", '""', '"\\u0000"', '"\\u202e"', '"\\n"', '"é"', "'/'",
    '"' + "a" * 3000 + '"',
    "1979-05-27",
    "1979-05-27T07:32:00Z", "07:32:00", "0x7fffffffffffffff", "[" * 40 + "]" * 40, "{a = {a = {a = 1}}}", "2", "3",
    "1e9",
    '"auto"', '"k=1:300"', '"k=1:1000000000"', '"0:1e9:1e-9"', '"1e400"', '"1/0"', '"20:140:20,,"', '"udp://[::1"',
    '"udp://h:99999999"', '"mqtt://user:password@h/t"', '"one in 1e999 days"', '"none in a day"', "[nan, nan]",
    "[1e308, -1e308]", '"1e999999999"', '"1e-999999999"',
]  # fmt: skip
KEYS = [
    "",
    "x",
    '"a.b"',
    '"\\u0000"',
    '"\\n"',
    "é",
    "axes",
    "x.y.z",
    '"' + "k" * 500 + '"',
    "source.url",
    "__proto__",
    "1",
]


def damaged(text: str, rng: random.Random) -> bytes:
    """The text with some values, keys, lines and bytes that are others."""
    lines = text.splitlines()
    for _ in range(rng.choice([1, 1, 1, 2, 3, 6])):
        at, what = rng.randrange(len(lines)), rng.randrange(10)
        line = lines[at]
        if what < 5 and "=" in line:
            lines[at] = line.split("=")[0] + "= " + rng.choice(ODD)
        elif what == 5 and "=" in line:
            lines[at] = rng.choice(KEYS) + " =" + line.split("=", 1)[1]
        elif what == 6:
            lines.insert(at, rng.choice(lines))
        elif what == 7:
            lines[at] = f"[{rng.choice(['axes.', 'loop.', ''])}{rng.choice(KEYS)}]"
        elif what == 8:
            del lines[at]
            lines = lines or [""]
        else:
            lines[at] = "".join(rng.sample(line, len(line))) if line else rng.choice(ODD)
    data = bytearray("\n".join(lines).encode())
    if rng.random() < 0.1:
        at = rng.randrange(len(data) + 1)
        data[at : at + rng.randrange(3)] = rng.randbytes(rng.randrange(4))
    return bytes(data)


def used(axis: Axis) -> None:
    """As far as a run uses it before its first sample."""
    follower = live_follower(axis, RATE_HZ)
    if axis.fit is not None:
        chosen_model(axis.fit, PlantKinds("velocity", "torque"))
        fitter_of(axis.fit, PlantKinds("velocity", "torque"))
    assert follower.settings.lines.window <= 1 << 24


def rss_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def is_one_sentence(error: LivebodeError) -> None:
    message = str(error)
    assert message
    assert message.isprintable(), message
    assert len(message) < 1200, len(message)


@contextmanager
def printable() -> Iterator[None]:
    try:
        yield
    except LivebodeError as error:
        is_one_sentence(error)
        raise


def test_odd_configurations_give_axes_or_a_sentence(tmp_path: Path) -> None:
    rng = random.Random(5)
    path, good, before = tmp_path / "axes.toml", 0, rss_bytes()
    for _ in range(CASES):
        text = damaged(WHOLE if rng.random() < 0.5 else WHOLE.split("[axes")[0], rng)
        try:
            for axis in axes_of(text, path, {}).values():
                used(axis)
            good += 1
        except LivebodeError as error:
            is_one_sentence(error)
        except BaseException:
            print(text.decode(errors="replace"))
            raise
    assert good > CASES / 50
    assert rss_bytes() - before < GROWN_BYTES_MAX


@pytest.mark.parametrize(
    ("data", "code", "facts"),
    [
        (b"a = " + b"{a=" * 50_000 + b"1" + b"}" * 50_000, "nested-too-deeply", {}),
        (b"[" + b"a." * 50_000 + b"a]\n", "nested-too-deeply", {}),
        (b"a" + b".a" * 200_000 + b" = 1\n", "nested-too-deeply", {}),
        (b'"a, b"' + b' . "c = d"' * 50_000 + b" = 1\n", "nested-too-deeply", {}),
        (b"a = {" + b"b." * 200_000 + b"c = 1}\n", "nested-too-deeply", {}),
        (b"a = " + b"9" * 10_000, "not-toml", {}),
        (b"#" * (FILE_BYTES_MAX + 1), "file-too-long", {"limit_bytes": FILE_BYTES_MAX}),
        (b"\xff\xfe\0", "not-text", {}),
        (b"a = 1\na = 2", "not-toml", {}),
        (b"[source]\n[source]", "not-toml", {}),
        (b"\x00", "not-toml", {}),
        (b"[source]\nlog = 1979-05-27\n[signals]\noutput = 'y'", "value-invalid",
         {"key": "source.log", "value": "datetime.date(1979, 5, 27)"}),
        (b"[source]\nlog = \"a\\u0000b\"\n[signals]\noutput = 'y'", "value-invalid", {"key": "source.log"}),
        (b"[lines]\n" + b"\n".join(b"k%d = 1" % k for k in range(50_000)), "key-unknown", {"key": "lines.k0"}),
        (b"\n".join(b"[axes.a%d]" % k for k in range(5000)), "axes-invalid", {"count": 5000, "limit": 256}),
    ],
    ids=range(15),
)  # fmt: skip
def test_hostile_configurations_are_refused_with_their_code(
    tmp_path: Path, data: bytes, code: str, facts: dict
) -> None:
    path = tmp_path / "axes.toml"
    path.write_bytes(data)
    with refused(ConfigError, code, **facts), printable():
        ConfigurationFile(path, {}).read()


def test_brackets_without_an_end_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "axes.toml"
    path.write_bytes(b"a = " + b"[" * 100_000)
    with pytest.raises(ConfigError) as caught, printable():  # Python's versions give up at another depth
        ConfigurationFile(path, {}).read()
    assert caught.value.code in ("config.not-toml", "config.nested-too-deeply")


def test_the_configuration_that_is_mutated_is_valid_itself() -> None:
    axes = axes_of(WHOLE.encode(), Path("axes.toml"), {"lines": {"window": 1600}})
    assert axes.keys() == {"x", "y"}
    assert axes["x"].source.url == "tcp://127.0.0.1:5001"
    assert axes["y"].tracking.hop == 40
    assert [axis.lines.window for axis in axes.values()] == [1600, 1600]
    assert axes["y"].fit == Axis.of(tomllib.loads(WHOLE.split("[axes")[0]), "").fit
