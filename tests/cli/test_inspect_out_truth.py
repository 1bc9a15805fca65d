"""`livebode inspect --out`: its configuration has the roles, lines and window of the simulated machine."""

from __future__ import annotations

import json
import os
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Lines
from livebode.excitation import multisine
from livebode.interface import write_examples
from livebode.plugins import named
from tests.support.command import livebode, signals, write_csv
from tests.support.drive_exports import EXPORTS, TRUTH
from tests.support.terminals import on_terminal


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("new")
    write_examples(["standstill", "moving", "chirp"], folder)
    return folder


def written(folder: Path, log: str, *options: object) -> dict[str, dict[str, object]]:
    out = folder / "axis.toml"
    result = livebode("inspect", folder / log, "--yes", "--force", "--out", out, *options)
    assert result.code == 0, result.err
    return tomllib.loads(out.read_text("utf-8"))


def test_at_standstill_the_proposals_are_the_roles_and_the_lines_of_the_simulation(folder: Path) -> None:
    found = written(folder, "standstill.csv")
    assert found["signals"] == {"excitation": "w", "input": "u", "output": "velocity"}
    assert found["lines"] == {"frequencies": "20:140:10", "window": 400}
    assert found["tracking"] == {"estimator": "joint", "average": True}


def test_in_motion_the_position_is_the_schedule_and_the_window_leaves_bins_without_excitation(folder: Path) -> None:
    found = written(folder, "moving.parquet")
    assert found["signals"]["schedule"] == "x"
    assert found["lines"] == {"frequencies": "20:140:20", "window": 400}
    assert "average" not in found["tracking"]


def test_a_chirp_that_does_not_repeat_is_for_the_local_polynomial_method(folder: Path) -> None:
    found = written(folder, "chirp.csv")
    assert found["tracking"] == {"estimator": "lpm"}
    assert "fit" not in found


@pytest.mark.parametrize(("lines", "unit", "model"), [
    ("50,100,150,200", "rad/s", "auto"),
    ("50,100,150,200", "", None),  # neither a velocity nor a position
    ("50,100,200", "rad/s", None),  # six numbers for six parameters
])  # fmt: skip
def test_a_model_is_fitted_where_the_output_and_the_lines_permit_it_and_the_run_has_it(
    tmp_path: Path, lines: str, unit: str, model: str | None
) -> None:
    period = multisine(Lines.parse(lines, 1000, 100))
    w = np.resize(period, 3000)
    y = 2 * np.concatenate([period[-1:], w[:-1]]) + 0.01 * np.random.default_rng(1).standard_normal(3000)
    time = np.arange(3000) / 1000
    write_csv(tmp_path / "log.csv", {"t": time, "w": w, "u": w, f"y [{unit}]" if unit else "z": y})
    roles = ("--excitation", "w", "--input", "u", "--output", "y" if unit else "z")
    assert written(tmp_path, "log.csv", *roles).get("fit", {}).get("model") == model
    assert livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run").code == 0
    assert written(tmp_path, "log.csv", *roles, "--fit", "none").get("fit") is None


def test_without_units_names_or_the_samples_suffice(tmp_path: Path) -> None:
    given = signals()
    write_csv(tmp_path / "log.csv", given)
    assert written(tmp_path, "log.csv")["signals"] == {"excitation": "w", "input": "u", "output": "y"}
    renamed = {"t": given["t"], "c": given["y"], "b": given["u"], "a": given["w"]}
    write_csv(tmp_path / "names.csv", renamed)
    for options in ((), ("--output", "c"), ("--output", "c", "--input", "b")):
        assert written(tmp_path, "names.csv", *options)["signals"] == {"excitation": "a", "input": "b", "output": "c"}


def test_of_signals_that_have_nothing_to_do_with_each_other_the_sentence_lists_the_channels(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    write_csv(tmp_path / "log.csv", {"t": signals()["t"]} | {name: rng.standard_normal(2000) for name in "abc"})
    refused = livebode("inspect", tmp_path / "log.csv", "--yes", "--out", tmp_path / "other.toml")
    assert (refused.code, (tmp_path / "other.toml").exists()) == (2, False)
    assert "not recognised among a, b, c; give --output CHANNEL" in refused.err


def test_exchanged_roles_are_refused_and_nothing_is_written(folder: Path) -> None:
    out = folder / "exchanged.toml"
    refused = livebode(
        "inspect", folder / "standstill.csv", "--yes", "--out", out, "--input", "velocity", "--output", "u"
    )
    assert refused.code == 2
    assert "'velocity'" in refused.err
    assert not out.exists()


@pytest.mark.parametrize(
    ("model", "sentence"),
    [("foo", "there is no model 'foo'; choose auto, rigid"), ("modal", "is fitted to finished runs only")],
)
def test_a_model_that_a_run_would_refuse_is_refused_and_nothing_is_written(
    folder: Path, model: str, sentence: str
) -> None:
    out = folder / "fitted.toml"
    refused = livebode("inspect", folder / "standstill.csv", "--yes", "--out", out, "--fit", model)
    assert (refused.code, sentence in refused.err, out.exists()) == (2, True, False)


def test_an_existing_file_and_a_missing_terminal_are_one_sentence_each(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    existing = folder / "standstill.toml"
    refused = livebode("inspect", folder / "standstill.csv", "--yes", "--out", existing)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "replace it with --force" in refused.err
    with open(os.devnull) as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        refused = livebode("inspect", folder / "standstill.csv", "--out", folder / "asked.toml")
        missing = livebode("inspect", folder / "nofile.csv", "--out", folder / "asked.toml")
    assert "there is no terminal to ask on; take the proposals with --yes" in refused.err
    assert "there is no file" in missing.err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--schedule", "x"), "--schedule belongs to --out; give --out axis.toml too"),
        (("--no-average",), "--average belongs to --out"),
        (("--out", "other.toml", "--from", "3"), "--from and --out exclude each other"),
    ],
)
def test_an_option_of_the_list_or_of_the_configuration_belongs_to_it(
    folder: Path, words: tuple[str, ...], says: str
) -> None:
    refused = livebode("inspect", folder / "standstill.csv", *words)
    assert (refused.code, says in refused.err) == (2, True), refused.err


def test_json_gives_the_configuration(folder: Path) -> None:
    out = folder / "json.toml"
    result = livebode("inspect", folder / "chirp.csv", "--json", "--out", out)
    assert json.loads(result.out)["configuration"] == tomllib.loads(out.read_text("utf-8"))


def test_on_a_terminal_it_lists_the_channels_asks_again_after_a_wrong_name_and_takes_numbers(folder: Path) -> None:
    out = folder / "asked.toml"
    answers = [
        ("Excitation", "nonsense"), ("select one", "1"), ("Input", ""), ("Output", "velocity"), ("Schedule", "-"),
        ("Estimator", ""), ("Average", "n"), ("Model", "two-mass"),
    ]  # fmt: skip
    code, text = on_terminal(
        "inspect", folder / "moving.parquet", "--out", out, columns=120, kind="dumb", answers=answers
    )
    assert code == 0, text
    assert "torque" in text
    assert tomllib.loads(out.read_text("utf-8"))["signals"] == {"excitation": "w", "input": "u", "output": "velocity"}
    assert "[fit]" in out.read_text("utf-8")


def test_an_answer_that_the_recording_contradicts_is_asked_again_and_the_others_are_kept(folder: Path) -> None:
    out = folder / "again.toml"
    answers = [
        ("Excitation", "w"), ("Input", "velocity"), ("Output", "u"), ("Schedule", "-"), ("Estimator", "joint"),
        ("Average", "y"), ("Model", "two-mass"), ("look exchanged", ""), ("Output", ""),
    ]  # fmt: skip
    code, text = on_terminal(
        "inspect", folder / "standstill.csv", "--out", out, columns=160, kind="dumb", answers=answers
    )
    assert (code, text.count("Model to fit"), text.count("Excitation, the signal")) == (0, 1, 1), text
    table = tomllib.loads(out.read_text("utf-8"))
    assert table["signals"] == {"excitation": "w", "input": "u", "output": "velocity"}
    assert table["fit"] == {"model": "two-mass"}


def test_a_recording_without_time_and_names_is_asked_for_its_rate_and_proposes_all_else(tmp_path: Path) -> None:
    given = signals()
    write_csv(tmp_path / "log.csv", {"Sample": np.arange(2000), **dict(zip(("Ch1", "Ch2", "Ch3"), (
        given["y"], given["w"], given["u"],
    )))})  # fmt: skip
    out = tmp_path / "axis.toml"
    answers = [("Rate", "-5"), ("not a positive number", "1000"), *((word, "") for word in (
        "Excitation", "Input", "Output", "Schedule", "value 1 of", "value 1 of", "Estimator", "Average", "Model",
    ))]  # fmt: skip
    code, text = on_terminal("inspect", tmp_path / "log.csv", "--out", out, columns=160, kind="dumb", answers=answers)
    assert code == 0, text
    table = tomllib.loads(out.read_text("utf-8"))
    assert table["signals"] == {"excitation": "Ch2", "input": "Ch3", "output": "Ch1"}
    assert table["source"]["rate_hz"] == 1000.0
    assert "units" not in table["source"]
    assert livebode("run", out, "--out", tmp_path / "run").code == 0


@pytest.mark.parametrize(
    ("name", "question", "answer", "scale"),
    [
        ("% of the rated torque", "What is 1 % of Actual torque, such as 0.024 N m", "0.024 N m", 1),
        ("torque constant", "What is 1 A of iq_A, such as 0.35 N m", "0.35 N m", 1),
        ("without units", "What is the value 1 of b, such as 0.024 N m", "mNm", 1),
        ("% of the rated torque", "What is 1 % of Actual torque, such as 0.024 N m", "0.048 N m", 2),
    ],
)
def test_what_one_unit_of_a_channel_is_gives_the_parameters_of_the_machine(
    name: str, question: str, answer: str, scale: float, tmp_path: Path
) -> None:
    export, out = EXPORTS[name], tmp_path / "axis.toml"
    export.write(tmp_path / "log.csv")
    excitation, torque, output = export.names
    units = [("the value 1 of c, such as 1 rpm", "rad/s")] * (name == "without units")
    answers = [
        ("Schedule", "-"), (question, "3 %"), ("not a number of a unit", answer), *units,
        ("Estimator", ""), ("Average", ""), ("Model", "two-mass"),
    ]  # fmt: skip
    code, text = on_terminal(
        "inspect", tmp_path / "log.csv", "--out", out, "--excitation", excitation, "--input", torque,
        "--output", output, columns=160, kind="dumb", answers=answers,
    )  # fmt: skip
    assert code == 0, text
    assert tomllib.loads(out.read_text("utf-8"))["source"]["units"][torque] == answer
    done = livebode("run", out, "--out", tmp_path / "run")
    assert done.code == 0, done.err
    found = json.loads(livebode("fit", tmp_path / "run", "--json").out)["quantities"]
    assert found["Keff"]["value"] == pytest.approx(scale * TRUTH["Keff"], rel=2e-3)


def test_the_models_of_plugins_are_offered_too(folder: Path) -> None:
    question = on_terminal(
        "inspect", folder / "standstill.csv", "--out", folder / "models.toml", columns=160, kind="dumb",
        answers=[(word, "") for word in ("Excitation", "Input", "Output", "Schedule", "Estimator", "Average", "Model")],
    )[1]  # fmt: skip
    assert all(model in question for model in named("models"))


def test_the_schedule_is_not_proposed_for_a_position_that_only_vibrates(tmp_path: Path) -> None:
    given = signals()
    write_csv(tmp_path / "log.csv", given | {"x [m]": 0.8 + 1e-3 * given["y"]})
    assert "schedule" not in written(tmp_path, "log.csv")["signals"]
    ramp = given | {"x [m]": 0.8 + 1e-3 * given["y"] + np.sin(3 * given["t"])}
    write_csv(tmp_path / "moves.csv", ramp)
    assert written(tmp_path, "moves.csv")["signals"]["schedule"] == "x"
