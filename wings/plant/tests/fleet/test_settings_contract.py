"""fleet.toml and the names of axes in the log."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.configuration import MachineSection
from livebode.core import ConfigError, FleetError
from livebode_plant.fleet.demo import write_simulated_fleet
from livebode_plant.fleet.fleet_settings import FleetSettings
from livebode_plant.fleet.subjects import axis_key, axis_path

NAMES = st.text(st.characters(exclude_categories=["C", "Z"], exclude_characters="/"), max_size=20)


@given(NAMES, NAMES, NAMES, NAMES)
def test_a_key_has_four_tokens_and_gives_the_path_again(site: str, line: str, machine: str, axis: str) -> None:
    section = MachineSection(site=site, line=line, machine=machine, axis=axis)
    key = axis_key(section)
    assert axis_path(key) == section.path
    assert len(key.split(".")) == 4
    assert all(token and not set(token) & set(" *>.\t") and token.isascii() for token in key.split("."))


def test_a_fleet_has_its_axes_by_key(tmp_path: Path) -> None:
    path = write_simulated_fleet(tmp_path, "nats://127.0.0.1:4222", axes=3, partitions=2, workers=1)
    settings = FleetSettings.read(path)
    assert sorted(settings.read_axes()) == [
        "demo._.machine%201.x",
        "demo._.machine%201.y",
        "demo._.machine%202.x",
    ]
    assert settings.edge.buffer == tmp_path / "edge-buffer"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "'axes' is missing"),
        ('axes = ["a.toml"]\npartition = 3', "no setting 'partition'; did you mean 'partitions'"),
        ('axes = ["a.toml"]\npartitions = 0', "partitions = 0 is not usable"),
        ('axes = ["a.toml"]\n[log]\nsize_gb = "much"', "log.size_gb = 'much' is not usable"),
    ],
)
def test_a_wrong_key_or_value_is_named(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "fleet.toml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        FleetSettings.read(tmp_path / "fleet.toml")


def test_axes_without_a_machine_or_with_the_same_one_are_refused(tmp_path: Path) -> None:
    path = write_simulated_fleet(tmp_path, "nats://127.0.0.1:4222", axes=1, partitions=2, workers=1)
    first = tmp_path / "axes" / "axis-01.toml"
    (tmp_path / "axes" / "axis-02.toml").write_text(first.read_text())
    with pytest.raises(FleetError, match="another axis of the fleet"):
        FleetSettings.read(path).read_axes()
    (tmp_path / "axes" / "axis-02.toml").write_text(first.read_text().split("\n\n", 1)[1])
    with pytest.raises(FleetError, match=r"no \[machine\] section"):
        FleetSettings.read(path).read_axes()


def test_a_pattern_without_files_is_named(tmp_path: Path) -> None:
    (tmp_path / "fleet.toml").write_text('axes = ["nothing/*.toml"]')
    with pytest.raises(ConfigError, match=r"nothing/\*\.toml"):
        FleetSettings.read(tmp_path / "fleet.toml").read_axes()
