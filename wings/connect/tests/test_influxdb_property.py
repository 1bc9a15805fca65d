"""The line protocol: whatever is encoded, an independent reader of its grammar finds again."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from livebode_connect.influxdb import Value, line
from tests.support.receivers import HttpReceiver, PublishedAxis, until

TEXT = st.text(st.characters(codec="utf-8", exclude_characters="\r\n\t\x00\\"), min_size=1, max_size=12)
WORDS = st.text(st.characters(codec="utf-8", exclude_characters="\r\n\t\x00"), max_size=20)
FIELD = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False), st.integers(-(2**63), 2**63 - 1), st.booleans(), WORDS
)


def read(text: str) -> tuple[str, dict[str, str], dict[str, Value], int]:
    """A point, letter by letter as the protocol's reference describes it."""
    parts, inside, escaped, now = [], False, False, ""
    for letter in text:
        if escaped:
            now, escaped = now + letter, False
        elif letter == "\\":
            now, escaped = now + letter, True
        elif letter == " " and not inside:
            parts.append(now)
            now = ""
        else:
            inside ^= letter == '"' and len(parts) == 1
            now += letter
    head, fields, stamp = [*parts, now]
    measurement, *tags = re.split(r"(?<!\\),", head)
    pairs = (re.split(r"(?<!\\)=", tag) for tag in tags)
    found = re.findall(r'((?:\\.|[^,=\\])+)=("(?:\\.|[^"\\])*"|[^,]+)(?:,|$)', fields)
    return (
        plain(measurement),
        {plain(name): plain(value) for name, value in pairs},
        {plain(name): typed(value) for name, value in found},
        int(stamp),
    )


def plain(text: str) -> str:
    return re.sub(r"\\([,= ])", r"\1", text)


def typed(text: str) -> Value:
    if text.startswith('"'):
        return re.sub(r'\\(["\\])', r"\1", text[1:-1])
    if text in ("true", "false"):
        return text == "true"
    return int(text[:-1]) if text.endswith("i") else float(text)


@given(TEXT.filter(lambda text: '"' not in text), st.dictionaries(TEXT, TEXT, max_size=3), st.data())
def test_a_point_is_read_as_it_was_written(measurement: str, tags: dict[str, str], data: st.DataObject) -> None:
    fields = data.draw(st.dictionaries(TEXT.filter(lambda text: '"' not in text), FIELD, min_size=1, max_size=4))
    found = read(line(measurement, tags, fields, 1.5))
    assert found == (measurement, tags, fields, 1_500_000_000)
    assert {name: type(value) for name, value in found[2].items()} == {n: type(v) for n, v in fields.items()}


@given(st.text(max_size=20))
@example("\\\x00")
@example("C:\\ D:\\,x\\=y")
def test_no_text_begins_another_point(text: str) -> None:
    text = text.encode("utf-8", "ignore").decode()
    found = line("m", {"axis": text, "b": "c"}, {"f": text, "g": 1}, 0.0)
    assert "\n" not in found
    _, tags, fields, _ = read(found)
    assert tags["b"] == "c"
    assert fields["g"] == 1


@pytest.mark.parametrize("code", [200, 204])
def test_results_and_events_are_points_of_the_database(tmp_path: Path, code: int) -> None:
    (tmp_path / "token").write_text("abc")
    with HttpReceiver() as receiver:
        receiver.code = code
        section = {
            "kind": "influxdb", "url": f"http://127.0.0.1:{receiver.port}/api/v2/write?org=plant&bucket=axes",
            "token_file": str(tmp_path / "token"), "values": ["parameters", "responses", "status"], "interval_s": 0.1,
        }  # fmt: skip
        with PublishedAxis(tmp_path, section) as axis:
            axis.measure()
            axis.change(-2.0, 3)
            awaited = ("livebode_event", "livebode_response", "Keff_bound")  # a round may come before the fit
            bodies = until(
                lambda: (
                    (bodies := [body.decode() for _, _, body in receiver.posted])
                    and all(any(name in body for body in bodies) for name in awaited)
                    and bodies
                ),
                "points",
            )
    path, headers, _ = receiver.posted[0]
    assert path == "/api/v2/write?org=plant&bucket=axes"
    assert headers["Authorization"] == "Token abc"
    points = [read(text) for body in bodies for text in body.split("\n")]
    of = {name: [point for point in points if point[0] == name] for name, *_ in points}
    (event,) = of["livebode_event"]
    assert event[2]["message"] == "stiffness -2.0 % (no. 3)"
    assert abs(event[3] - 1_800_000_003 * 10**9) < 1000
    measured = of["livebode"][-1][2]
    assert 0 < measured["Keff_bound"] < measured["Keff"]
    frequencies = {float(point[1]["frequency_hz"]) for point in of["livebode_response"]}
    assert frequencies == {float(f) for f in range(20, 141, 10)}
