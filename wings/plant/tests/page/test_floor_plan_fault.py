"""Floor plans: shapes, text and colours remain; what could run or load something is refused."""

from __future__ import annotations

import urllib.error
import urllib.request
from pathlib import Path

import pytest

from livebode.core import ConfigError
from livebode_plant.page.floor_plan import floor_plan, sanitised
from tests.support.served import served

SVG = '<svg xmlns="http://www.w3.org/2000/svg" {0}>{1}</svg>'


def plan(body: str, attributes: str = 'viewBox="0 0 10 10"') -> str:
    return SVG.format(attributes, body)


def test_a_drawing_keeps_its_shapes_and_colours() -> None:
    text = sanitised(
        plan(
            '<metadata>who</metadata><g transform="translate(1 2)"><rect id="hall/m1/x" x="1" width="3" height="4"'
            ' style="fill:#eee;stroke-width:2;-inkscape-x:y" class="a"/><text x="1">Süd &amp; Nord</text></g>',
            'width="210mm" height="100"',
        )
    )
    for part in ('viewBox="0 0 210 100"', 'id="hall/m1/x"', 'fill="#eee"', 'stroke-width="2"', "Süd &amp; Nord"):
        assert part in text
    for part in ("who", "style", "class", "mm"):
        assert part not in text


@pytest.mark.parametrize(
    "text",
    [
        plan("<script>alert(1)</script>"),
        plan('<g onclick="alert(1)"/>'),
        plan("", 'viewBox="0 0 1 1" onload="alert(1)"'),
        plan('<a href="javascript:alert(1)"/>'),
        plan('<image href="http://host/x.png"/>'),
        plan('<use xmlns:xlink="http://www.w3.org/1999/xlink" xlink:href="http://host/#x"/>'),
        plan("<foreignObject/>"),
        plan("<style>@import url(//host)</style>"),
        plan("<defs><style>*{}</style></defs>"),
        plan('<rect fill="url(http://host/#p)"/>'),
        plan('<rect style="fill:url(http://host/#p)"/>'),
        plan('<rect fill="\\75rl(x)"/>'),
        plan('<animate attributeName="href" to="javascript:alert(1)"/>'),
        plan('<set attributeName="onclick" to="alert(1)"/>'),
        plan('<x:script xmlns:x="http://www.w3.org/2000/svg">alert(1)</x:script>'),
        plan('<rect xmlns="http://www.w3.org/1999/xhtml"/>'),
        '<!DOCTYPE svg [<!ENTITY a "b">]>' + plan("<text>&a;</text>"),
        '<?xml-stylesheet href="http://host/x.css"?>' + plan(""),
        plan("<g>" * 100 + "</g>" * 100),
        plan("<g/>" * 50_001),
        plan("<rect", ""),
        plan("", ""),
        "<html/>",
        "",
    ],
    ids=lambda text: f"{text[47:75]} {len(text)}",
)
def test_a_hostile_drawing_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"^its? "):
        sanitised(text)


def test_the_message_names_the_file(tmp_path: Path) -> None:
    file = tmp_path / "plan.svg"
    with pytest.raises(ConfigError, match="cannot read"):
        floor_plan(file)
    for content, why in ((b"\xff\xfe<\0", "UTF-8"), (b" " * (5 << 20), "larger"), (b"<svg/>", "not an SVG")):
        file.write_bytes(content)
        with pytest.raises(ConfigError, match=why):
            floor_plan(file)


def test_the_page_of_a_fleet_has_the_drawing_of_the_command_line(tmp_path: Path) -> None:
    """As all of the page, to somebody with the token of --axis only."""
    (tmp_path / "hall.svg").write_text(plan('<rect id="Augsburg/body/gantry 1" width="3" height="4"/>'))
    (tmp_path / "token").touch(0o600)
    (tmp_path / "token").write_text("x" * 32)
    (tmp_path / "serve.toml").write_text('[serve]\ntoken_file = "token"\n')
    asked = ("fleet", "status", "--demo", 6, "--plan", tmp_path / "hall.svg", "--axis", tmp_path / "serve.toml")
    with served(tmp_path, *asked, "--trends", "https://plant/trends", "--port", 0) as (_, url):
        known = {"Authorization": f"Bearer {'x' * 32}"}
        drawing = urllib.request.urlopen(urllib.request.Request(f"{url}api/plan", headers=known)).read()
        assert b'id="Augsburg/body/gantry 1"' in drawing
        with pytest.raises(urllib.error.HTTPError, match="401"):
            urllib.request.urlopen(f"{url}api/plan")
