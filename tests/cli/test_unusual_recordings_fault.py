"""Unusual recordings and the runs from them: every command has a result, or refuses in a sentence.

A constant, one sample, one line, no line, flags, values that overflow a square: each is an empty set for some step.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from livebode.interface import write_examples
from tests.support.command import Result, livebode, write_csv

EXAMPLES = int(os.environ.get("LIVEBODE_COMMANDS_FUZZ", "0"))
"""Recordings for each kind of command; by default a few, always the same."""
campaign = settings(max_examples=EXAMPLES or 12, derandomize=not EXAMPLES, database=None)

PERIOD = 50
FORMS = {
    "excitation": lambda w, _: w,
    "input": lambda w, rng: w + 0.05 * rng.standard_normal(w.size),
    "output": lambda w, rng: 2 * np.roll(w, 1) + 0.01 * rng.standard_normal(w.size),
    "zero": lambda w, _: 0 * w,
    "constant": lambda w, _: 0 * w + 3.7,
    "nan": lambda w, _: w + np.nan,
    "one finite": lambda w, _: np.where(np.arange(w.size) == w.size // 2, 1.0, np.nan),
    "holes": lambda w, rng: np.where(rng.random(w.size) < 0.05, np.nan, w),
    "late": lambda w, _: np.where(np.arange(w.size) < w.size // 2, np.nan, w),
    "silent first": lambda w, _: np.where(np.arange(w.size) < 0.7 * w.size, 0, w),
    "every other": lambda w, _: np.where(np.arange(w.size) % 2, np.nan, w),
    "infinite": lambda w, _: np.where(np.arange(w.size) % 7 == 3, np.inf, w),
    "one line": lambda w, _: np.sin(2 * np.pi * np.arange(w.size) / 10),
    "one period": lambda w, _: np.sin(2 * np.pi * np.arange(w.size) / w.size),
    "integers": lambda w, _: np.round(3 * w),
    "boolean": lambda w, _: np.where(w > 0, 1.0, 0.0),
    "flag": lambda w, _: np.where(np.arange(w.size) > w.size // 2, 1.0, 0.0),
    "huge": lambda w, _: 1e300 * w,
    "largest": lambda w, _: np.where(np.arange(w.size) % 2, 1.7e308, -1.7e308),
    "large": lambda w, _: 1e30 * w,
    "denormal": lambda w, _: 5e-324 * np.round(100 * w),
    "small": lambda w, _: 1e-200 * w,
    "ramp": lambda w, _: 1e-3 * np.arange(w.size),
    "drift": lambda w, rng: 1e-3 * np.cumsum(rng.standard_normal(w.size)),
    "impulse": lambda w, _: np.where(np.arange(w.size) == w.size // 3, 1.0, 0.0),
    "supply": lambda w, _: 24.0 + np.isin(np.arange(w.size), [w.size // 3, w.size // 2]),
    "alternating": lambda w, _: np.where(np.arange(w.size) % 2, -1.0, 1.0),
    "noise": lambda w, rng: rng.standard_normal(w.size),
    "square": lambda w, _: np.where(np.arange(w.size) % 20 < 10, 1.0, -1.0),
    "strokes": lambda w, _: np.sin(6 * np.pi * np.arange(w.size) / w.size),
    "offset": lambda w, _: 1e9 + w,
}
USUAL = {"w": "excitation", "u": "input", "y": "output", "s": "strokes"}


@dataclass(frozen=True)
class Recipe:
    samples: int
    forms: dict[str, str]
    time: str
    suffix: str
    seed: int

    def columns(self) -> dict[str, NDArray[np.float64]]:
        rng = np.random.default_rng(self.seed)
        at = np.arange(PERIOD) / PERIOD
        w = np.resize(np.sum([np.sin(2 * np.pi * (k * at + rng.random())) for k in (1, 3, 5, 7, 9)], 0), self.samples)
        step = {"even": 0.0, "jitter": 0.05, "uneven": 0.5}.get(self.time)
        time = {} if step is None else {"t": (np.arange(self.samples) + step * rng.uniform(-1, 1, self.samples)) / 1000}
        return time | {name: FORMS[form](w, rng) for name, form in self.forms.items()}

    def write(self, folder: Path) -> tuple[Path, list[str]]:
        """The file, and the options without which its rate is unknown."""
        path, columns = folder / f"log{self.suffix}", self.columns()
        if self.suffix == ".npz":
            np.savez(path, **columns)
        else:
            write_csv(path, columns)
        return path, ["--rate", "1000"] if self.time == "none" else []


@st.composite
def recipes(draw: st.DrawFn) -> Recipe:
    """A usual recording in which some things are unusual."""
    sizes = st.sampled_from([1, 2, 3, 5, 8, 16, 49, 50, 51, 99, 100, 101, 150, 200, 400, 1000, 1500])
    unusual = draw(st.dictionaries(st.sampled_from(sorted(USUAL)), st.sampled_from(sorted(FORMS)), max_size=3))
    return Recipe(
        draw(st.one_of(sizes, st.integers(1, 1500))),
        USUAL | unusual,
        draw(st.sampled_from(["even", "even", "jitter", "uneven", "none"])),
        draw(st.sampled_from([".csv", ".npz"])),
        draw(st.integers(0, 99)),
    )


READING = (
    "inspect LOG", "inspect LOG --excitation w --output y --input u", "inspect LOG --excitation y --json",
    "inspect LOG --lines 20:200:20 --window 50", "inspect LOG --lines 20:200:20",
    "inspect LOG --excitation w --from 3periods", "inspect LOG --yes --out x.toml",
    "inspect LOG --yes --out x.toml --excitation w --input u --output y",
    "inspect LOG --yes --out x.toml --excitation - --input u --output y --schedule w",
    "friction LOG --velocity y --input u", "friction LOG --position s --velocity y --input u --json",
    "friction LOG --position y --input u", "orders LOG --position s --input u",
    "orders LOG --velocity y --angle s --input u",
)  # fmt: skip
RUNS = (
    "--input u", "--input u --excitation w", "--input u --excitation w --average --accept-roles",
    "--input u --estimator direct --accept-roles", "--input u --estimator direct --window HALF --accept-roles",
    "--input u --estimator direct --window 50 --average --accept-roles", "--excitation w --estimator indirect",
    "--input u --excitation w --accept-roles --lines 20:200:20 --window 50 --hann",
    "--input u --excitation w --accept-roles --lines 20 --window 50 --all-periods",
    "--input u --excitation w --accept-roles --lines 20:200:40 --window 50 --difference y --spikes u",
    "--input u --excitation w --accept-roles --lines 20:200:40 --window 50 --schedule s",
    "--input u --excitation w --accept-roles --lines 20:200:40", "--input u --excitation w --skip-periods 2",
    "--input u --excitation w --accept-roles --continue", "--input u --estimator lpm", "--input u --estimator welch",
    "--input u --excitation w --estimator lpm", "--input u --estimator lpm --lines 20:200:20 --window 60",
    "--input u --estimator welch --lines 20:200:20 --window 50", "--output-only", "--output-only --band 10:300",
    "--input u --input w --output s --matrix",
    "--input u --input w --output s --matrix --lines 20:200:20 --window 50 --accept-roles",
)  # fmt: skip
USES = (
    "fit RUN", "fit RUN --model rigid", "fit RUN --model two-mass", "fit RUN --model three-mass",
    "fit RUN --model two-mass-gain", "fit RUN --model modal", "fit RUN --model rational", "margins RUN",
    "margins RUN --axis loop.toml", "validate RUN --loop", "validate RUN --loop --axis loop.toml",
    "tune RUN --axis loop.toml", "tune RUN --shaper", "validate RUN --on LOG", "validate RUN --on LOG --model rigid",
    "validate RUN --on LOG --at-lines", "validate RUN --on RUN", "learn RUN --out b.json", "report RUN",
    "compare RUN RUN", "export RUN --to csv", "export RUN --to mat --mean", "export RUN --to uff --at 0.1",
    "export RUN --to csv --parameters", "export RUN --to json --lpv", "friction RUN", "orders RUN",
    "run LOG RUN --output y --input u --out RUN2",
)  # fmt: skip
LOOP = '[source]\nlog = "log.csv"\n[signals]\ninput = "u"\noutput = "y"\n[loop]\ngain = 0.3\nintegral_time_s = 0.02\n'


def called(folder: Path, command: str, *options: str, half: int = 0) -> Result:
    """The command in this folder; it has no internal error, and prints no warning of a library."""
    log = next(folder.glob("log.*"))
    words = {"LOG": log, "RUN": folder / "run", "RUN2": folder / "run2", "HALF": half, "3periods": "3 periods"}
    words |= {name: folder / name for name in ("x.toml", "b.json", "loop.toml")}
    result = livebode(*(words.get(word, word) for word in command.split()), *options)
    assert result.code != 1, f"{command}\n{result.err}"
    assert "Traceback" not in result.err, f"{command}\n{result.err}"
    assert "Warning:" not in result.err, f"{command}\n{result.err}"
    assert result.code in (0, 2, 3, 4), command
    return result


@campaign
@given(recipes(), st.sampled_from(READING))
def test_each_command_that_reads_a_recording_has_a_result_or_a_sentence(recipe: Recipe, command: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        called(Path(folder), command, *recipe.write(Path(folder))[1])


@campaign
@given(recipes(), st.sampled_from(RUNS), st.lists(st.sampled_from(USES), max_size=12 if EXAMPLES else 1, unique=True))
def test_each_run_and_each_command_that_reads_it_has_a_result_or_a_sentence(
    recipe: Recipe, options: str, uses: list[str]
) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rate = recipe.write(folder)[1]
        (folder / "loop.toml").write_text(LOOP)
        half = max(int(0.6 * recipe.samples), 1)
        called(folder, f"run LOG --out RUN --output y {options}", *rate, half=half)
        if (folder / "run").is_dir():
            for use in uses:
                called(folder, use, *(rate if use.startswith("run") else ()))


@pytest.mark.parametrize(("column", "time"), [("supply", "even"), ("drift", "jitter"), ("flag", "even")])
def test_new_proposes_the_roles_beside_a_channel_without_lines(column: str, time: str, tmp_path: Path) -> None:
    Recipe(1500, USUAL | {"s": column}, time, ".csv", 1).write(tmp_path)
    result = called(tmp_path, "inspect LOG --yes --out x.toml")
    assert result.code == 0, result.err
    assert 'output = "y"' in (tmp_path / "x.toml").read_text()


@pytest.mark.parametrize("window", [2001, 4000])
def test_a_window_of_which_the_recording_has_less_than_two_is_refused_with_what_works(
    window: int, tmp_path: Path
) -> None:
    """It works: the lines, or the window of the sentence."""
    Recipe(4000, USUAL, "even", ".csv", 1).write(tmp_path)
    command = f"run LOG --input u --output y --estimator direct --out RUN --window {window}"
    refused = called(tmp_path, command)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert f"the recording has 4000 samples, less than two windows of {window}" in refused.err
    assert "set lines.frequencies, or a window of at most 2000 samples" in refused.err
    assert called(tmp_path, f"{command} --lines k=10:30:20").code == 0
    shutil.rmtree(tmp_path / "run")
    assert called(tmp_path, command.replace(str(window), "2000")).code == 0


def test_a_response_of_zero_ends_with_a_sentence_in_place_of_the_plot(tmp_path: Path) -> None:
    Recipe(1000, USUAL | {"y": "denormal"}, "even", ".npz", 1).write(tmp_path)
    options = "--input u --excitation w --lines 20:200:40 --window 50 --accept-roles"
    assert called(tmp_path, f"run LOG --output y --out RUN {options}").code == 0


def test_the_examples_of_the_product_are_tracked_with_any_window_or_refused(tmp_path: Path) -> None:
    write_examples(["standstill"], tmp_path)
    samples = (tmp_path / "standstill.csv").read_text().count("\n") - 1
    (tmp_path / "standstill.csv").rename(tmp_path / "log.csv")
    for share in (0.3, 0.5, 0.6, 0.9, 1.0, 1.1):
        command = "run LOG --input u --output velocity --excitation w --out RUN --force --window"
        assert called(tmp_path, f"{command} {int(share * samples)}").code in (0, 2)
