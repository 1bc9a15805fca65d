"""What `livebode design` left, on the PLC: the same bits, brought in over its ramp, at its rate and lines only."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Lines, RecordingError
from livebode.excitation import Waveform, function_block, multisine
from livebode_design import write
from livebode_drives.excitation_file import read_designed
from tests.support.command import livebode
from tests.support.errors import refused
from tools.structured_text import Machine

LINES = Lines((1, 3, 7), 20, rate_hz=1000.0)
PERIOD = multisine(LINES, [0.3, 0.2, 0.1], "random", seed=3)
AXIS = """\
[source]
log = "log.parquet"
[signals]
excitation = "w"
output = "y"
[lines]
frequencies = "50, 150, 350"
window = 20
[loop.velocity]
gain = 1.0
rate_hz = 500.0
rate_divider = 2
"""
RATED = AXIS.replace("[signals]", "rate_hz = 2000.0\n[signals]")
AUTO = AXIS.replace('frequencies = "50, 150, 350"\nwindow = 20', "")
FILE = "--excitation"


def plc(folder: Path, *more: object, axis: str = AXIS, about: dict[str, object] | None = None):
    (folder / "axis.toml").write_text(axis)
    write(folder / "excitation.npz", Waveform(LINES, PERIOD, about or {}))
    return livebode("plc", folder / "axis.toml", "--limit", 2, *more, "--out", folder / "plc")


@pytest.mark.parametrize(
    ("ramp_s", "periods", "axis"), [(None, 1, AXIS), (0.06, 3, AXIS), (0.04, 2, AUTO), (0.5, 25, AXIS)]
)
def test_the_plc_plays_the_bits_of_the_design_with_its_ramp(ramp_s, periods: int, axis: str, tmp_path: Path) -> None:
    about = {} if ramp_s is None else {"ramp_s": ramp_s}
    done = plc(tmp_path, "--excitation", tmp_path / "excitation.npz", axis=axis, about=about)
    assert done.code == 0, done.err
    block = Machine((tmp_path / "plc" / "FB_Multisine.st").read_text()).instance("FB_Multisine")
    block()  # fills the table; so it begins at the next border
    w = []
    for _ in range(LINES.window * (periods + 3) - 1):
        block(enable=True)
        w.append(block["w"])
        assert block["steady"] == (len(w) >= LINES.window * (periods + 1))
    ramped = np.array(w[LINES.window - 1 :]).reshape(-1, LINES.window)
    np.testing.assert_array_equal(ramped[periods:], [PERIOD, PERIOD])
    level = np.arange(LINES.window * periods).reshape(periods, -1) / (LINES.window * periods)
    np.testing.assert_allclose(ramped[:periods], PERIOD * level, rtol=1e-14)
    assert "bins 1, 3, 7" in (tmp_path / "plc" / "FB_SlidingDft.st").read_text()


def test_the_block_that_the_design_leaves_fits_the_program(tmp_path: Path) -> None:
    """FB_excitation in FB_Multisine's place, as wings/drives/docs/plc.md says: MAIN runs, and w is the same."""
    assert plc(tmp_path, "--excitation", tmp_path / "excitation.npz").code == 0
    write(tmp_path / "excitation.st", Waveform(LINES, PERIOD), "excitation")
    texts = {path.name: path.read_text() for path in (tmp_path / "plc").iterdir()}
    played = []
    for block, name in (
        (texts["FB_Multisine.st"], "FB_Multisine"),
        ((tmp_path / "excitation.st").read_text(), "FB_excitation"),
    ):
        main = texts["MAIN.st"].replace("F_GetSystemTime()", "0").replace("FB_Multisine", name)
        others = (texts[f"{other}.st"] for other in ("FB_SlidingDft", "ST_LivebodeRing", "FB_LivebodeRing"))
        program = Machine(block, main, *others).instance("MAIN")
        program["enable"] = True
        played.append([])
        for _ in range(5 * LINES.window):
            program()
            played[-1].append(program["w"])
    assert np.any(played[0])
    assert played[0] == played[1]


@pytest.mark.parametrize(
    ("axis", "more", "message"),
    [
        (RATED, ("--rate", 1000, "--amplitude", 1), "is 1000 Hz, but source.rate_hz is 2000 Hz"),
        (AXIS, ("--rate", 4000, "--amplitude", 1), "gives 1000 Hz, but the sampling rate is 4000 Hz"),
        (AXIS, ("--rate", 4000, FILE), "is 4000 Hz, but the designed excitation is 1000 Hz"),
        (RATED, (FILE,), "the designed excitation is 1000 Hz, but source.rate_hz is 2000 Hz"),
        (AXIS.replace("window = 20", "window = 40"), (FILE,), "lines.window is 40, but the design's period has 20"),
        (AXIS.replace("50, 150, 350", "50, 100"), (FILE,), "the design does not excite 100 Hz"),
        (AXIS, (FILE, "--amplitude", 1), "both or neither of amplitude and designed"),
        (AXIS, ("--rate", 1000), "both or neither of amplitude and designed"),
        (AXIS, (FILE, "--limit", 0.1), "exceeds limit=0.1"),
        (AXIS, ("--rate", 0, "--amplitude", 1), "rate_hz=0.0 is not above 0"),
        (AXIS, ("--rate", 1000, "--amplitude", -0.3), "amplitude=-0.3 is not a finite number of at least"),
        (AXIS, ("--rate", 1000, "--amplitude", 1e-320), "amplitude=1e-320 is not a finite number of at least"),
        (AXIS.replace("gain", "gian"), (FILE,), "there is no setting 'loop.velocity.gian'; did you mean 'gain'?"),
        (AXIS.replace("gain = 1.0\n", ""), (FILE,), "'loop.velocity.gain' is missing; add it"),
    ],
)  # fmt: skip
def test_options_that_contradict_the_axis_or_the_design_are_refused(
    axis: str, more, message: str, tmp_path: Path
) -> None:
    given = [part for word in more for part in ([word, tmp_path / "excitation.npz"] if word == FILE else [word])]
    done = plc(tmp_path, *given, axis=axis)
    assert done.code == 2
    assert message in " ".join(done.err.split())
    assert not (tmp_path / "plc").exists()


def archive(**arrays: object) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


WHOLE = {"samples": PERIOD, "frequency_hz": LINES.frequency_hz, "rate_hz": 1000.0, "facts": "{}"}
with io.BytesIO(archive(**WHOLE)) as whole, zipfile.ZipFile(whole) as members:
    CUT = whole.getvalue()[: members.infolist()[0].header_offset + 90]


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"t,w\n0,1\n",
        CUT,
        archive(samples=PERIOD),
        archive(**WHOLE | {"facts": "[1, 2"}),
        archive(**WHOLE | {"facts": "[1, 2]"}),
        archive(**WHOLE | {"samples": PERIOD + 1j}),
        archive(**WHOLE | {"samples": PERIOD * np.nan}),
        archive(**WHOLE | {"samples": PERIOD.astype(str)}),
        archive(**WHOLE | {"samples": np.array([{}], object)}),
        archive(**WHOLE | {"frequency_hz": np.array([50, 1e300])}),
        archive(**WHOLE | {"rate_hz": np.zeros(1)}),
        archive(**WHOLE | {"facts": json.dumps({"ramp_s": None})}),
        archive(**WHOLE | {"facts": json.dumps({"ramp_s": "long"})}),
        archive(**WHOLE | {"facts": json.dumps({"ramp_s": 1e300})}),
        archive(**WHOLE | {"facts": json.dumps({"ramp_s": -5})}),
    ],
)
def test_a_file_that_is_not_a_design_is_refused(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "mine.npz"
    path.write_bytes(data)
    with refused(RecordingError, "not-an-excitation", path=str(path)):
        read_designed(path)


def test_a_design_that_does_not_exist_is_refused_by_the_command(tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text(AXIS)
    path = tmp_path / "mine.npz"
    done = livebode("plc", tmp_path / "axis.toml", "--limit", 2, "--excitation", path, "--out", tmp_path / "plc")
    assert (done.code, done.err.count("\n")) == (2, 1), done.err
    assert f"there is no file {path}" in done.err


@pytest.mark.parametrize("more", [(), ("--twincat",)])
def test_force_replaces_all_but_a_program_that_was_completed(more: tuple[str, ...], tmp_path: Path) -> None:
    given = "--excitation", tmp_path / "excitation.npz", *more
    assert plc(tmp_path, *given).code == 0
    written = {path.name: path.read_bytes() for path in (tmp_path / "plc").iterdir()}
    (main,) = [name for name in written if name.startswith("MAIN.")]
    own = written[main] + b"(* the drive of press 4 *)"
    (tmp_path / "plc" / main).write_bytes(own)
    assert plc(tmp_path, *given, "--force").code == 0
    new = main.replace("MAIN.", "MAIN.new.")
    assert {path.name: path.read_bytes() for path in (tmp_path / "plc").iterdir()} == {
        **written, main: own, new: written[main],
    }  # fmt: skip


def test_a_ramp_as_long_as_the_counter_holds_is_taken() -> None:
    """Half a second at 100 kHz with a window of 2 are 25,000 periods."""
    assert "level = 50000)" in function_block([1.0, -1.0], rate_hz=1e5, limit=1, ramp_periods=25_000)
