"""Run, design and learn give what the commands give."""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pyarrow as pa
import pytest

import livebode
from livebode import ConfigError, Loop, OutputError, RecordError, Run, UsageError
from livebode.analysis import MARGIN_NAMES as NAMES
from livebode.fitting import mean_response
from livebode.records import to_json
from tests.support.command import livebode as command
from tests.support.errors import refused


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return livebode.example_run(tmp_path_factory.mktemp("interface") / "monday")


def printed(*arguments: object) -> dict:
    done = command(*arguments, "--json")
    assert done.code == 0, done.err
    return json.loads(done.out)


def test_a_run_describes_itself_in_a_line(run: Run) -> None:
    assert repr(run) == (
        "<Run 'monday': velocity from u, excited by w; 13 lines, 20 … 140 Hz; 40 responses in 1 s; 1 event>"
    )
    assert "<li>13 lines, 20 … 140 Hz</li>" in run._repr_html_()


def test_nothing_but_the_summary_is_read_at_first(run: Run, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text((run.path / "run.json").read_text())
    opened = Run(str(tmp_path))
    assert len(opened.lines) == 13
    with pytest.warns(livebode.core.DamageWarning, match=r"manifest.jsonl is damaged: the file is missing"):
        assert sum(map(len, opened.batches())) == 0
    with refused(RecordError, "damaged", path=str(tmp_path / "manifest.jsonl"), table="responses"):
        _ = opened.responses
    with refused(RecordError, "not-a-run"):
        Run(tmp_path / "none")
    assert repr(opened).endswith("events unreadable (record.unreadable)>")


def test_the_average_is_the_mean_of_the_responses(run: Run) -> None:
    expected = mean_response(run.responses)[0]
    np.testing.assert_array_equal(run.average.value, expected.value)
    np.testing.assert_array_equal(run.average.sigma, expected.sigma)
    parts = list(run.batches(from_s=0.5))
    assert all((part.time_s >= 0.5).all() for part in parts)
    assert sum(map(len, parts)) == np.count_nonzero(run.responses.time_s >= 0.5)
    assert sum(map(len, run.batches())) == len(run.responses)


@pytest.mark.parametrize(
    ("options", "arguments"),
    [
        ((), {}),
        (("--model", "rigid"), {"model": "rigid"}),
        (("--fix", "Js=0.0028", "--band", "30:120"), {"fixed": {"Js": 0.0028}, "band_hz": (30, 120)}),
    ],
)
def test_a_fit_is_that_of_the_command(run: Run, options: tuple[str, ...], arguments: dict) -> None:
    done = command("fit", run.path, *options, "--json")
    found, expected = run.fit(**arguments), json.loads(done.out)
    assert found.asked is not None
    assert (found.status, found.asked.name) == (expected["status"], expected["model"])
    for name, value, _, _ in found.rows() if found.status == "ok" else ():
        assert value == pytest.approx(expected["quantities"][name]["value"], rel=1e-9)


def test_margins_are_those_of_the_command(run: Run) -> None:
    found, expected = run.margins(), printed("margins", run.path)["margins"]
    for name in NAMES:
        assert found.of(name)[0] == pytest.approx(expected[name]["value"], rel=1e-9)
    assert repr(found).startswith("<Margins: 1 row; gain_margin ")
    doubled = run.margins(run.fit(), loop=Loop(feedback=2 * livebode.PID(gain=0.2308, rate_hz=4000)))
    assert doubled.of("gain_margin")[0] < found.of("gain_margin")[0] - 5


def test_a_wrong_argument_of_a_fit_is_named(run: Run) -> None:
    with pytest.raises((ConfigError, UsageError), match="two-mas"):
        run.fit("two-mas")
    with refused(ConfigError, "value-invalid"):
        run.fit(side="above")


def test_parameters_are_those_that_were_recorded(run: Run) -> None:
    table = run.parameters
    frame = pa.table(table).to_pandas().query("name == 'Js' and status == 'ok'")
    assert len(frame) == np.count_nonzero(run.responses.valid.all(axis=1))
    assert abs(frame["value"].mean() / 0.0028 - 1) < 0.01
    recorded = [json.loads(line) for line in (run.path / "events.jsonl").read_text().splitlines()]
    assert [event.kind for event in run.events] == [line["kind"] for line in recorded]


def test_the_plot_has_the_average_in_front(run: Run) -> None:
    magnitude, _ = run.plot()
    np.testing.assert_allclose(magnitude.lines[0].get_ydata(), run.average.magnitude_db)
    assert magnitude.get_legend_handles_labels()[1][0] == "average"
    plt.close("all")


MACHINE = {"belt": {"standstill": {"position_m": 0.8}}, "excitation": {"band_hz": [20, 140], "window": 400}}


def test_a_design_writes_what_the_command_writes(tmp_path: Path) -> None:
    file = tmp_path / "experiment.toml"
    file.write_text("[belt.standstill]\nposition_m = 0.8\n[excitation]\nband_hz = [20, 140]\nwindow = 400\n")
    expected = printed("design", file, "--out", tmp_path / "command", "--amplitude", 0.5, "--to", "csv")
    found = json.loads(to_json(livebode.design(str(file), amplitude_n_m=0.5).plain()))
    assert found == {name: expected[name] for name in found}
    livebode.design(MACHINE, tmp_path / "python", amplitude_n_m=0.5)
    text = [(tmp_path / place / "axis.toml").read_text() for place in ("command", "python")]
    assert text[0] == text[1]
    with refused(OutputError, "exists"):
        livebode.design(MACHINE, tmp_path / "python")


def test_a_mapping_without_an_excitation_and_a_misspelt_key_are_refused() -> None:
    with refused(ConfigError, "key-missing"):
        livebode.design({"belt": {}})
    with refused(ConfigError, "key-unknown"):
        livebode.design(MACHINE | {"excitation": {"bnd_hz": [20, 140]}})


def test_a_baseline_is_learned_from_paths_and_from_runs_alike(tmp_path: Path) -> None:
    run = livebode.example_run(tmp_path / "healthy", seconds=4)
    found = [livebode.learn([given]) for given in (run, str(run.path))]
    assert repr(found[0]) == "<Baseline: lines and parameters, 13 lines, 20 … 140 Hz; learned from 1 run>"
    assert found[0].runs == found[1].runs == (str(run.path),)
    np.testing.assert_array_equal(found[0].tables[0].mean, found[1].tables[0].mean)
