"""[report]: what is not possible is refused by one sentence that names the key and the remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from livebode.configuration import Axis, ReportSection, read_template
from livebode.core import ConfigError
from livebode_reports.first_page import BYTES_MAX, read_logo

AXIS = '[source]\nlog = "a.csv"\n[signals]\noutput = "y"\n'
WRONG = {
    '[[report.limits]]\nquantity = "resonance"\nmin = 1': ("report.limits.0.quantity", "did you mean 'resonance_hz'?"),
    '[[report.limits]]\nquantity = "xyzzy"\nmin = 1': ("not a quantity", "Quantities: resonance_hz, "),
    '[[report.limits]]\nquantity = "stiffness"': ("needs min, max or both", "report.limits.0"),
    '[[report.limits]]\nquantity = "stiffness"\nmin = 2\nmax = 1': ("min 2 that is not below max 1", "report.limits.0"),
    '[[report.limits]]\nquantity = "stiffness"\nmin = 2\nband_hz = [1, 2]': ("band_hz applies to |G|", "stiffness"),
    '[[report.limits]]\nquantity = "|T|"\nmax = 2\nband_hz = [4, 2]': ("not two ascending frequencies", "|T|"),
    '[[report.limits]]\nquantity = "|T|"\nmaximum = 2': ("'report.limits.0.maximum'", "did you mean 'max'?"),
    '[report]\nserial = "7"': ("'report.serial'", "did you mean 'serial_number'?"),
    '[report]\npaper = "a3"': ("report.paper = 'a3'", "'a4' or 'letter'"),
    '[report]\nlanguage = "xx"': ("report.language = 'xx'", "en, de, zh-CN"),
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_not_possible_is_refused_in_an_axis_and_in_a_template(text: str, tmp_path: Path) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(AXIS + text, encoding="utf-8")
    for read in (Axis.read, read_template):
        with pytest.raises(ConfigError) as refused:
            read(path)
        for words in (*WRONG[text], str(path)):
            assert words in str(refused.value)
        assert "\n" not in str(refused.value)


def test_a_file_without_a_report_is_no_template(tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text(AXIS, encoding="utf-8")
    with pytest.raises(ConfigError, match="has no \\[report\\] section"):
        read_template(tmp_path / "axis.toml")


def test_a_logo_is_beside_its_file_and_options_replace_what_they_name(tmp_path: Path) -> None:
    (tmp_path / "t.toml").write_text('[report]\nlogo = "l.png"\noperator = "Ann"\n', encoding="utf-8")
    found = read_template(tmp_path / "t.toml")
    assert found.logo == tmp_path / "l.png"
    changed = found.over({"operator": None, "customer": "C", "machine": ""})
    assert changed == ReportSection(logo=tmp_path / "l.png", operator="Ann", customer="C")


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "neither a PNG nor an SVG"),
        (b"\x89PNG\r\n\x1a\n" + bytes(90), "is damaged"),
        (b"<svg xmlns='http://www.w3.org/2000/svg'><script>1</script></svg>", "may not load or execute"),
        (b"<!DOCTYPE x [<!ENTITY a 'b'>]><svg xmlns='http://www.w3.org/2000/svg'/>", "may not load or execute"),
        (b"<svg xmlns='http://www.w3.org/2000/svg'><image href='http://x/y.png'/></svg>", "may not load or execute"),
        (b"<html xmlns='http://www.w3.org/1999/xhtml'/>", "neither a PNG nor an SVG"),
        (b" " * (BYTES_MAX + 1), "more than 1 MiB"),
    ],
    ids=["empty", "damaged", "script", "entity", "link", "html", "long"],
)
def test_a_logo_that_cannot_be_used_is_refused_by_one_sentence(data: bytes, why: str, tmp_path: Path) -> None:
    path = tmp_path / "logo"
    path.write_bytes(data)
    with pytest.raises(ConfigError, match=why):
        read_logo(path, "")
    with pytest.raises(ConfigError, match="cannot be read"):
        read_logo(tmp_path / "none.png", "")
