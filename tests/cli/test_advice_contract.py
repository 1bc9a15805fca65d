"""Advice is executed: what a sentence of the product names exists, applies, and the same cause is gone.

ADVICE has situations with the sentence and the commands that follow it. The last test lists the advice of errors to use
a command or option that is not executed here, with the reason.
"""

from __future__ import annotations

import ast
import json
import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.support.command import livebode, signals, write_csv
from tests.support.sentences import ADVISES, made, templates, text_of

RATE_HZ = 4000


def in_bursts(folder: Path) -> Path:
    """A FIFO whose stamps come in bursts of 198 µs and 406 µs; nothing is missing. A mode of 47 Hz rings."""
    steps_s = np.where(np.arange(8000) % 4 == 3, 406e-6, 198e-6)
    t_s = np.arange(8000) / RATE_HZ
    ringing = sum((t_s >= at) * np.exp(-6 * (t_s - at)) * np.sin(2 * np.pi * 47 * (t_s - at)) for at in (0.0, 1.0))
    noise = 0.02 * np.random.default_rng(1).standard_normal(8000)
    return write_csv(folder / "burst.csv", {"time": np.cumsum(steps_s), "accel_x": ringing + noise})


def strokes(folder: Path) -> Path:
    """A log of strokes whose stamps jitter by 12 %, more than a spectrum of even samples bears."""
    rng, t_s = np.random.default_rng(2), np.arange(20_000) / 1000
    velocity = 2 * np.sin(2 * np.pi * 0.4 * t_s)
    torque = 0.05 * np.gradient(velocity, t_s) + 0.3 * np.sign(velocity) + 0.1 * velocity
    torque += 0.01 * rng.standard_normal(t_s.size)
    stamps_s = t_s + 1e-3 * 0.12 * rng.standard_normal(t_s.size)
    return write_csv(folder / "strokes.csv", {"t": stamps_s, "velocity": velocity, "torque": torque})


def uneven_signals(folder: Path) -> Path:
    """Samples of which the stamps say nothing, and the excitation does not repeat."""
    rng = np.random.default_rng(3)
    u = rng.standard_normal(4000)
    y = 0.5 * np.roll(u, 1) + 0.01 * rng.standard_normal(4000)
    return write_csv(folder / "noise.csv", {"t": np.arange(4000) / 1000, "u": u, "y": y})


def without_header(folder: Path) -> Path:
    given = signals()
    rows = zip(given["t"], given["u"], given["y"])
    (folder / "bare.csv").write_text("".join(f"{t:.4f},{u:.6f},{y:.6f}\n" for t, u, y in rows))
    return folder / "bare.csv"


def long_window(folder: Path) -> Path:
    return write_csv(folder / "short.csv", signals(samples=4000))


CASES: dict[str, tuple[Callable[[Path], Path], str, str]] = {
    "output-only of bursts": (
        in_bursts,
        "run LOG --output-only --output accel_x --band 20:200",
        r"--rate \S+ --time none",
    ),
    "friction of jittering stamps": (
        strokes,
        "friction LOG --velocity velocity --input torque",
        r"--rate \S+ --time none",
    ),
    "a period of noise": (uneven_signals, "run LOG --input u --output y --estimator direct", r"--estimator lpm"),
    "no header": (without_header, "run LOG --input c2 --output c3 --estimator direct", r"time = '([^']+)'"),
    "a long window": (
        long_window,
        "run LOG --input u --output y --estimator direct --window 2400",
        r"window of at most (\d+)",
    ),
}
AS_OPTION = {"no header": "--time", "a long window": "--window"}


@pytest.mark.parametrize("case", CASES)
def test_the_advice_of_a_refusal_works(case: str, tmp_path: Path) -> None:
    """Where the command names only what it refuses, `inspect` has the values."""
    write, command, pattern = CASES[case]
    log = write(tmp_path)
    words = [str(log) if word == "LOG" else word for word in command.split()]
    into = ["--out", str(tmp_path / "run")] if words[0] == "run" else []
    refused = livebode(*words, *into)
    assert refused.code == 2, refused
    found = re.search(pattern, refused.err) or re.search(pattern, livebode("inspect", log).out)
    assert found is not None, refused.err
    option = AS_OPTION.get(case)
    advice = [option, found[1]] if option else shlex.split(found[0])
    followed = livebode(*words, *into, *advice)
    assert followed.code == 0, followed.err


ROLES = "--excitation w --input u --output y"
ADVICE = [
    # (refused, what its remedy says, what follows it, one after the other)
    (
        "run twins.csv",
        "lists the channels and proposes their roles",
        "inspect twins.csv",
        "inspect twins.csv --yes --out roles.toml",
        "run roles.toml --out r",
    ),
    (
        "run twins.csv",
        "name them by --excitation, --input and --output",
        "run twins.csv --excitation a --input b --output y --out r",
    ),
    (
        "inspect quiet.csv --yes --out n.toml",
        "give --output CHANNEL",
        "inspect quiet.csv --yes --input b --output c --out n.toml",
    ),
    ("inspect log.csv --out n.toml", "take the proposals with --yes", "inspect log.csv --yes --out n.toml"),
    (
        "inspect other.csv --out n.toml",
        "name the channels that you know by --excitation, --input and --output",
        "inspect other.csv --yes --excitation a --input b --output c --out n.toml",
    ),
    (
        "inspect quiet.csv --yes --output c --out n.toml",
        "give --excitation and --input",
        "inspect quiet.csv --yes --output c --excitation a --input b --estimator lpm --out n.toml",
    ),
    ("inspect log.csv --yes --out one.toml", "replace it with --force", "inspect log.csv --yes --out one.toml --force"),
    (
        "run log.csv --output y --band 20:200 --out r",
        "add --output-only",
        "run log.csv --output y --band 20:200 --output-only --out r",
    ),
    ("inspect log.csv --yes", "give --out axis.toml too", "inspect log.csv --yes --out n.toml"),
    ("export one", "give --to FORMAT", "export one --to csv --out one.csv"),
    ("export one", "or --sql QUERY to print rows", "export one --sql SELECT(1)"),
    ("export one --csv", "give --sql QUERY too", "export one --csv --sql SELECT(1)"),
    ("inspect log.csv --output y", "give --excitation", "inspect log.csv --output y --excitation w"),
    ("inspect log.csv --output y", "or --lines and --window", "inspect log.csv --output y --lines 50 --window 100"),
    ("inspect log.csv --lines 50 --window 100", "give --output", "inspect log.csv --lines 50 --window 100 --output y"),
    (
        "inspect log.csv --input u",
        "give --output, --lines and --window too",
        "inspect log.csv --input u --output y --lines 50 --window 100",
    ),
    (
        f"run log.csv {ROLES} --lines 70 --window 100 --out r",
        "set lines.frequencies to 'auto'",
        f"run log.csv {ROLES} --out r",
    ),
    (
        f"run log.csv {ROLES} --lines 70 --window 100 --out r",
        "check the recording with `livebode inspect`",
        "inspect log.csv --excitation w",
    ),
    (
        f"run noise.csv {ROLES} --lines 50,100 --window 100 --out r",
        "(--estimator lpm)",
        f"run noise.csv {ROLES} --lines 50,100 --window 100 --estimator lpm --out r",
    ),
    (
        "run nan.csv --input u --output y --estimator direct --lines 50 --window 100 --out r",
        "choose a shorter window",
        "run nan.csv --input u --output y --estimator direct --lines 50 --window 20 --out r",
    ),
    (
        "run nan.csv --input u --output y --estimator lpm --window 500 --out r",
        "choose a shorter window",
        "run nan.csv --input u --output y --estimator lpm --window 50 --out r",
    ),
    (
        "run modal.toml --out r",
        "fit the finished run with this model (livebode fit)",
        "fit noise --model modal --order 1",
    ),
    ("fit noise --order 2", "add --model modal or --model rational", "fit noise --model rational --order 2"),
    ("fit noise beside", "with one run for each output", "fit noise beside --model rational --order 2"),
    ("validate noise", "give --on LOG to test the fitted model", "validate noise --on beside --model rational"),
    ("learn one", "give --out BASELINE", "learn one --out new.json"),
    (
        "learn one --out healthy.json",
        "as its next version with --reason TEXT",
        "learn one --out healthy.json --reason moved",
    ),
    ("learn one --history healthy.json", "give --history alone", "learn --history healthy.json"),
    ("learn mean --out new.json", "compare two averaged runs (livebode compare)", "compare mean mean"),
    ("compare one one --operator X", "add --out FILE", "compare one one --operator X --out c.html"),
    ("compare one one --cart 1", "leave out --gantry and --cart", "compare one one"),
    ("report one --check --out r.html", "or use --template", "report one --check --template limits.toml --out r.html"),
    (
        "report one --ask --out r.html",
        "use the options --machine, --serial-number",
        "report one --machine M --serial-number 1 --out r.html",
    ),
]


OF_SENTENCES = [
    (f"run spike.csv {ROLES} --out r", "--all-periods includes them", f"run spike.csv {ROLES} --all-periods --out r"),
    (f"run log.csv {ROLES} --out r", "`livebode learn` creates one from healthy runs", "learn r --out new.json"),
]


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings and runs that the situations of ADVICE begin with."""
    folder = tmp_path_factory.mktemp("advice")
    given, rng = signals(), np.random.default_rng(4)
    write_csv(folder / "log.csv", given)
    write_csv(folder / "other.csv", dict(zip("tabc", given.values())))
    twins = {"y": given["y"], "y2": 2 * given["y"] + 0.01 * rng.standard_normal(2000)}
    write_csv(folder / "twins.csv", {"t": given["t"], "a": given["w"], "b": given["u"]} | twins)
    write_csv(folder / "quiet.csv", {"t": given["t"]} | {name: rng.standard_normal(2000) for name in "abc"})
    write_csv(folder / "nan.csv", given | {"y": np.where(np.arange(2000) % 60, given["y"], np.nan)})
    write_csv(folder / "spike.csv", given | {"y": given["y"] + 5 * (np.arange(2000) // 7 == 143)})
    w = rng.standard_normal(2000)
    y = lfilter([0, 0.01], [1, -1.84, 0.98], w) + 1e-3 * rng.standard_normal(2000)
    columns = {"t": np.arange(2000) / 1000, "w": w, "u": w + 0.1 * rng.standard_normal(2000), "y": y, "y2": 2 * y}
    write_csv(folder / "noise.csv", columns)
    modal = '[source]\nlog = "noise.csv"\n[signals]\ninput = "w"\noutput = "y"\n[tracking]\nestimator = "lpm"\n'
    (folder / "modal.toml").write_text(modal + '[fit]\nmodel = "modal"\n')
    limit = '[[report.limits]]\nquantity = "resonance_hz"\nmin = 50\n'
    (folder / "limits.toml").write_text(limit)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for command in (
            f"run log.csv {ROLES} --hop 10 --out one",
            f"run log.csv {ROLES} --average --out mean",
            "run noise.csv --input w --output y --estimator lpm --out noise",
            "run noise.csv --input w --output y2 --estimator lpm --out beside",
            "learn one --out healthy.json",
            "inspect log.csv --yes --out one.toml",
        ):
            assert livebode(*command.split()).code == 0, command
    return folder


@pytest.mark.parametrize("advice", ADVICE, ids=lambda advice: f"{advice[0].split(' --')[0]}: {advice[1]}")
def test_the_command_that_a_remedy_names_works(
    advice: tuple[str, ...], prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused, says, *followed = advice
    shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    before = livebode(*refused.split())
    assert (before.code, says in before.err) == (2, True), before
    for command in followed:
        after = livebode(*command.split())
        assert after.code in (0, 4), after.err  # 4: a limit of the report is not met


@pytest.mark.parametrize("advice", OF_SENTENCES, ids=lambda advice: advice[1])
def test_the_command_that_a_sentence_beside_results_names_works(
    advice: tuple[str, ...], prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, says, followed = advice
    shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    before = livebode(*first.split())
    assert (before.code, says in " ".join((before.out + before.err).split())) == (0, True), before
    after = livebode(*followed.split(), *["--force"] * followed.startswith("run"))
    assert after.code == 0, after.err
    assert says not in " ".join((after.out + after.err).split())


def excited(u: np.ndarray) -> Path:
    """An excitation, and the response of a machine to it."""
    return write_csv(Path("log.csv"), {"t": np.arange(u.size) / 1000, "u": u, "y": lfilter([0, 0.2], [1, -0.8], u)})


def tones(*frequencies_hz: float) -> np.ndarray:
    return np.asarray(np.sin(2 * np.pi * np.outer(frequencies_hz, np.arange(4000) / 1000)).sum(axis=0))


NOT_IN_A_BAND = {
    "two tones": tones(50**0.5, 307**0.5),
    "a decaying oscillation": np.exp(-3e-3 * np.arange(4000)) * np.sin(0.06 * np.arange(4000)),
}
RUN_LPM = shlex.split("run log.csv --input u --output y --estimator lpm --out r --json")


@pytest.mark.parametrize("excitation", NOT_IN_A_BAND)
def test_lpm_is_not_proposed_where_it_finds_nothing_and_says_why(
    excitation: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    excited(NOT_IN_A_BAND[excitation])
    seen = livebode("inspect", "log.csv", "--excitation", "u").out
    assert "The excitation is not recognised" in seen
    assert "--estimator lpm (for" not in seen
    written = livebode("inspect", "log.csv", "--yes", "--input", "u", "--output", "y", "--out", "n.toml")
    assert (written.code, Path("n.toml").exists()) == (2, False)
    found = livebode(*RUN_LPM)
    assert found.code == 2
    error = json.loads(found.err.splitlines()[-1])["error"]
    assert error["facts"]["reason"] == "not-separable"
    assert "or noise or a chirp that has power in a whole band" in error["remedy"]


@pytest.mark.parametrize("excitation", ["noise", "chirp", "random walk"])
def test_lpm_is_proposed_where_it_finds_responses(
    excitation: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    t, noise = np.arange(4000) / 1000, np.random.default_rng(5).standard_normal(4000)
    signal = {
        "noise": noise,
        "chirp": np.sin(2 * np.pi * (5 + 20 * t) * t),
        "random walk": np.cumsum(noise) / 30,
    }
    excited(signal[excitation])
    assert "--estimator lpm (for" in livebode("inspect", "log.csv", "--excitation", "u").out
    assert livebode("inspect", "log.csv", "--yes", "--input", "u", "--output", "y", "--out", "n.toml").code == 0
    assert 'estimator = "lpm"' in Path("n.toml").read_text()
    assert livebode(*RUN_LPM).code == 0


@pytest.mark.parametrize(
    ("mark", "delimiter"),
    [("---", ","), ("*** 12 samples lost ***", " "), ("GAP;GAP", ";"), ("u\ty", "\t"), ("2 lost", ",")],
)
def test_the_advice_at_the_mark_of_a_gap_leaves_the_gap(
    mark: str, delimiter: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a time the mark alone shows the gap: if it were deleted, the excitation would not repeat."""
    monkeypatch.chdir(tmp_path)
    given, command = signals(), "run log.csv --input u --output y --estimator direct --hop 20 --out r"
    for names, options, advice in (
        ("uy", "--rate 1000", r"replace it by '([^']+)'"),
        ("tuy", "", "()delete this line"),
    ):
        rows = [delimiter.join(f"{given[name][at]:.6f}" for name in names) for at in range(2000)]
        head = delimiter.join(names)
        Path("log.csv").write_text("\n".join([head, *rows[:800], mark, *rows[812:]]) + "\n")
        refused = livebode(*command.split(), *options.split())
        found = re.search(advice, refused.err)
        assert refused.code == 2
        assert found is not None, refused.err
        instead = [found[1].replace("\\t", "\t")] * bool(found[1])
        Path("log.csv").write_text("\n".join([head, *rows[:800], *instead, *rows[812:]]) + "\n")
        followed = livebode(*command.split(), *options.split(), "--force")
        assert followed.code == 0, followed.err


NOT_HERE = {
    "give --out FILE": "needs a lake: tests/cli/test_archive_trend_truth.py",
    "--free delay": "a model that contradicts its lines; with a free delay it does not: tests/cli/test_loop_truth.py",
    "--split": "needs a lake: tests/cli/test_archive_trend_truth.py",
    "choose one with --machine": "needs a lake with two machines",
    "livebode archive": "needs a lake: tests/archive",
    "livebode fleet": "needs a log: tests/fleet",
    "doctor --bundle": "after results that are not exactly once, which no situation makes",
    "livebode that wrote them": "another version of the package",
    "livebode doctor": "needs a machine",
    "livebode design": "needs a controller: wings/drives/tests",
    "livebode and start it again": "a live run: tests/runtime",
    "livebode first": "a live run: tests/runtime",
    "livebode after it": "needs LinuxCNC",
    "livebode validate --loop": "in wings/control/tests/test_check_loop_truth.py and test_tune_truth.py",
    "as in livebode fit": "in tests/cli/test_shaper_truth.py",
    "use livebode tune again": "a damaged tune.json, and tune takes 3 s",
    "leave out --output, --input": "a matrix run with described controllers",
    "--gantry FILE": "a matrix run of a described gantry",
    "--mean for the newest matrix": "in tests/cli/test_matrix_commands_contract.py",
    "livebode validate RUN --entry": "in tests/cli/test_matrix_commands_contract.py",
    "`livebode run`": "a record that names no channels, which no command writes",
    "`livebode run --force`": "a damaged run: tests/records/test_file_damage_fault.py",
    "export, by SQL": "an output-only run: wings/modes/tests/test_command_truth.py",
    "give --input CHANNEL": "only where the samples name an excitation and no input: tests/preparation",
    "--help": "every command has it: tests/meta/test_command_line.py",
    "describe the axis by [belt] in place of [measured]": "in wings/design/tests/test_simulated_measurement_truth.py",
    "livebode inspect ": "an address at which nothing usable comes",
    "install the wing": "an installation without a wing",
    "--trend keep leaves it in": "a signal that drifts: tests/cli/test_slow_signals_truth.py",
    "--no-unwrap leaves it as it is": "an angle that wraps: tests/cli/test_slow_signals_truth.py",
    "--hop {usual} gives the usual number": "a long recording: tests/preparation/test_long_recordings_truth.py",
    "choose a multiple of them as window": "in tests/preparation/test_roles_truth.py",
    "run a part of the recording (--from, --to)": "a drift: tests/runtime/test_average_truth.py",
}
"""Advice of errors that is not executed here, and why."""


def test_the_advice_of_every_error_is_executed_or_has_a_reason() -> None:
    executed = [advice[1] for advice in (*ADVICE, *OF_SENTENCES)]
    remedies = [
        (where, text)
        for where, _, call in made()
        if len(call.args) > 2
        for node in ast.walk(call.args[2])
        if ADVISES.search(text := text_of(node))
    ]
    remedies += [("a message", text) for text in templates() if ADVISES.search(text)]
    assert len(remedies) > 40
    left = [found for found in remedies if not any(says in found[1] for says in (*executed, *NOT_HERE))]
    assert left == []
    assert [says for says in NOT_HERE if not any(says in text for _, text in remedies)] == []
