"""archive.toml: what is read, and what is refused with a sentence that names it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import settings as run_with
from hypothesis import strategies as st

from livebode import ConfigError
from livebode_plant.archive.archive_settings import ArchiveSettings, Template
from livebode_plant.archive.archived_recordings import RecordingPlace, find_places, levels_of

TLS = 'certificate = "a.pem"\nkey = "a.key"\nauthority = "ca.pem"\n'
NAMES = st.text(st.characters(blacklist_characters="/", blacklist_categories=("Cs", "Cc")), min_size=1, max_size=8)


def settings(folder: Path, text: str = "", recipe: str = '[signals]\noutput = "y"\n') -> ArchiveSettings:
    (folder / "recipe.toml").write_text(recipe)
    (folder / "archive.toml").write_text('inputs = ["{machine}/*.csv"]\nrecipe = "recipe.toml"\nlake = "lake"\n' + text)
    return ArchiveSettings.read(folder / "archive.toml")


def test_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    found = settings(tmp_path, f"[cluster]\n{TLS}")
    assert found.lake == str(tmp_path / "lake")
    assert found.inputs == [str(tmp_path / "{machine}/*.csv")]
    assert found.cluster.key == tmp_path / "a.key"


@pytest.mark.parametrize(
    "cluster",
    [
        'address = "tcp://10.0.0.5:8786"',
        f'address = "tcp://10.0.0.5:8786"\n{TLS}',
        'address = "tls://head:8786"',
        'address = "head:8786"',
        f'address = "ucx://[::2]:8786"\n{TLS}',
        'kind = "ssh"\nhosts = ["a", "b"]',
        'kind = "slurm"',
    ],
)
def test_a_cluster_that_others_could_send_code_is_refused(tmp_path: Path, cluster: str) -> None:
    with pytest.raises(ConfigError, match="mutual TLS") as caught:
        settings(tmp_path, f"[cluster]\n{cluster}\n")
    assert caught.value.code == "config.cluster-open"


@pytest.mark.parametrize("cluster", ['address = "tcp://127.0.0.1:8786"', f'address = "tls://head:8786"\n{TLS}'])
def test_loopback_and_mutual_tls_are_accepted(tmp_path: Path, cluster: str) -> None:
    assert settings(tmp_path, f"[cluster]\n{cluster}\n").cluster.address


@pytest.mark.parametrize(
    ("text", "code", "key"),
    [
        ("[cluster]\nworker = 2", "key-unknown", "cluster.worker"),
        ("[cluster]\nworkers = 0", "value-invalid", "cluster.workers"),
        ('inputs = ["{plant}/*.csv"]', "not-toml", None),
        (f'[cluster]\nkind = "ssh"\n{TLS}', "incomplete", "cluster.hosts"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, text: str, code: str, key: str | None) -> None:
    with pytest.raises(ConfigError) as caught:
        settings(tmp_path, text)
    assert caught.value.code == f"config.{code}"
    assert caught.value.facts.get("key") == key


def test_a_recipe_has_no_source_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"source\.log"):
        settings(tmp_path, recipe='[source]\nlog = "a.csv"\n[signals]\noutput = "y"\n').axes()
    assert settings(tmp_path, recipe='[source]\nrate_hz = 4000.0\n[signals]\noutput = "y"\n').axes()[""].source.rate_hz


@pytest.mark.parametrize("text", ["{plant}/*.csv", "{line}/{line}/*.csv"])
def test_a_level_that_does_not_exist_or_is_there_twice_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match=r"level|twice"):
        Template(text).checked()


@run_with(max_examples=30)
@given(NAMES, NAMES, NAMES)
def test_a_template_finds_the_names_in_its_own_paths(line: str, machine: str, file: str) -> None:
    found = Template("s3://plant/{line}/x [1]/{machine}/*.csv").machine(f"s3://plant/{line}/x [1]/{machine}/{file}.csv")
    assert found == {"line": line, "machine": machine}


def test_levels_that_the_path_does_not_name_are_of_the_recipe(tmp_path: Path) -> None:
    place = RecordingPlace(tmp_path / "a.csv", 1, "1", (("machine", "press 4"),))
    assert levels_of(place, {"site": "Graz", "machine": "any"}) == {
        "site": "Graz", "line": None, "machine": "press 4", "axis": None,
    }  # fmt: skip


def test_a_file_that_two_inputs_name_is_one_place(tmp_path: Path) -> None:
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "a.csv").write_text("1")
    (one,) = find_places([Template(str(tmp_path / "{machine}/*.csv")), Template(str(tmp_path / "**/*.csv"))])
    assert dict(one.machine) == {"machine": "m"}
