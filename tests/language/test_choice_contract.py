"""The choice of a language: an option for documents, a key of the configuration for the page."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from pypdf import PdfReader

from livebode.configuration import ServeSection
from livebode.language import ENGLISH, available, catalogue
from tests.support.command import livebode
from tests.support.reports import measured, write_run


def test_a_report_is_in_the_language_of_the_option(tmp_path: Path) -> None:
    run = write_run(tmp_path / "one", measured(12, 1))
    found = livebode("report", run, "--language", "zh-CN")
    assert found.code == 0
    page = (run / "report.html").read_text("utf-8")
    assert '<html lang="zh-CN">' in page
    assert "频率响应" in page
    if "no font with Chinese letters" in found.out:
        assert not os.environ.get("CI"), "make system-packages installs a font"
        assert not (run / "report.pdf").exists()
    else:
        assert found.out.splitlines()[:2] == [str(run / "report.html"), str(run / "report.pdf")]
        reader = PdfReader(run / "report.pdf")
        assert reader.root_object["/Lang"] == "zh-CN"
        assert "频率响应" in "".join(sheet.extract_text() for sheet in reader.pages)

    found = livebode("report", run, "--language", "xx")
    assert found.code == 2
    assert "choose en, de, zh-CN" in found.err


def test_a_language_that_does_not_exist_is_rejected_in_the_configuration() -> None:
    assert ServeSection.model_validate({"language": "zh-CN"}).language == "zh-CN"
    with pytest.raises(ValueError, match="is not one of the languages en, de, zh-CN"):
        ServeSection.model_validate({"language": "xx"})
    with pytest.raises(KeyError):
        catalogue("xx")
    assert catalogue("en") is ENGLISH
    assert list(available()) == ["en", "de", "zh-CN"]
