"""The example drive in QEMU, end to end: its frames into `livebode run`, beside the samples they were computed from."""

from __future__ import annotations

import re
import signal
import socket
import struct
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from livebode import Lines, SlidingDFT, multisine
from livebode.sources.live import FrameDecoder, SpectraBatch
from tests.support.command import livebode, write_parquet
from tests.support.live_runs import started, table
from tests.support.peers.peer import PATIENCE_S, free_port
from tests.support.peers.plain import wait_read
from tests.support.targets import need_tools
from tools.firmware import M4F, ROOT, run

FOLDER = ROOT / "examples" / "drive"
LINES = Lines.parse("20:220:10", rate_hz=4000, window=400)
SECONDS = 6
# The excitation begins with the second period and is brought in over five; whole windows begin there.
RAMP = 5 * LINES.window
STEADY = LINES.window + RAMP
SPOILT = (STEADY + LINES.window) // 200 - 1
AXIS = (FOLDER / "axis.toml").read_text(encoding="utf-8")
URL = 'url = "tcp://127.0.0.1:5000"'


def constants() -> dict[str, float]:
    """What machine.c defines."""
    text = (FOLDER / "machine.c").read_text(encoding="utf-8")
    found = re.findall(r"#define (\w+) \(?([\d.e-]+)f(?: / ([\d.]+)f)?", text)
    return {name: float(over) / float(under or 1) for name, over, under in found}


def built(directory: Path, *defines: str) -> Path:
    """The example's own Makefile makes it."""
    options = [f"BUILD={directory}", f"PYTHON={sys.executable}", f"SECONDS={SECONDS}", f"DEFINES={' '.join(defines)}"]
    run("make", "-C", FOLDER, *options)
    return directory / "drive.elf"


@dataclass(frozen=True)
class Sent:
    """Numbers of the newest samples, sums (signals, spectra, bins), states, and samples (2, count)."""

    newest: np.ndarray
    sums: np.ndarray
    state: np.ndarray
    samples: np.ndarray
    bytes_of_spectra: int
    bytes_of_samples: int


def batches(stream: bytes) -> list:
    decoder, found, at = FrameDecoder(), [], 0
    while at < len(stream):
        (length,) = struct.unpack_from("<I", stream, at + 8)
        found.append(decoder.decode(stream[at : at + length]))
        at += length
    return [batch for batch in found if batch is not None]


def played(program: Path) -> Sent:
    """All that the drive sends in its time, which passes in QEMU as fast as it can."""
    directory = program.parent
    lines = ("-serial", "file:spectra.bin", "-serial", "file:samples.bin")
    run(*M4F.qemu(program, *lines, "-icount", "shift=4,sleep=off"), cwd=directory)
    streams = [(directory / f"{name}.bin").read_bytes() for name in ("spectra", "samples")]
    spectra, samples = map(batches, streams)
    assert all(isinstance(batch, SpectraBatch) for batch in spectra)
    assert [batch.first_sample for batch in samples] == list(range(0, SECONDS * 4000, 100))
    return Sent(
        np.array([batch.first_sample + batch.layout.hop - 1 for batch in spectra]),
        np.concatenate([batch.sums for batch in spectra], axis=1),
        np.concatenate([batch.state for batch in spectra]),
        np.concatenate([batch.data for batch in samples], axis=1),
        *map(len, streams),
    )


@pytest.fixture(scope="module")
def drive(tmp_path_factory) -> tuple[Path, Sent]:
    need_tools()
    program = built(tmp_path_factory.mktemp("drive"))
    return program, played(program)


def sums_of(samples: np.ndarray, dtype: str, constant: float) -> np.ndarray:
    """What the kernel makes of the samples on the host, at the drive's hop of 200."""
    data = samples.astype(dtype) - np.array([[0], [constant]], dtype)
    return SlidingDFT(400, LINES.bins, 2, dtype).process(data, 200, phase="fixed")


def test_the_frames_carry_the_bits_that_the_host_computes_from_the_same_samples(drive):
    _, sent = drive
    assert sent.newest.tolist() == list(range(199, SECONDS * 4000, 200))
    assert sent.state.tolist() == [1] * SPOILT + [0] * (len(sent.state) - SPOILT)
    assert np.array_equal(sent.sums.astype(np.complex64), sums_of(sent.samples, "float32", 30))


def test_twenty_spectra_a_second_are_less_than_a_quarter_of_the_samples(drive):
    _, sent = drive
    assert sent.bytes_of_spectra < sent.bytes_of_samples / 4


def test_the_excitation_is_the_design_and_the_responses_are_the_machines(drive):
    """Torque beside the controller's is the multisine to float's rounding, brought in evenly; y/u is the machine's."""
    _, sent = drive
    c = constants()
    u, y = sent.samples
    excitation = u - c["GAIN_N_M_S_RAD"] * (c["SPEED_RAD_S"] - y)
    period = multisine(LINES, 0.05)
    level = np.clip((np.arange(len(u)) - LINES.window) / RAMP, 0, 1)
    assert np.abs(excitation - np.resize(period, len(u)) * level).max() < 2e-6
    frf = (sent.sums[1, SPOILT:] / sent.sums[0, SPOILT:]).mean(axis=0)
    assert np.abs(frf / two_masses(c) - 1).max() < 3e-3


def two_masses(c: dict[str, float]) -> np.ndarray:
    """Motor velocity over torque at the lines, of machine.c's recursion: four steps of it are one sample."""
    h, k, d = c["STEP_S"], c["STIFFNESS_N_M_RAD"], c["DAMPING_N_M_S_RAD"]
    inertia = np.array([c["MOTOR_KG_M2"], c["LOAD_KG_M2"]])

    def step(x: np.ndarray, torque: float) -> np.ndarray:
        motor, load, twist = x
        spring = k * twist + d * (motor - load)
        motor, load = motor + h * (torque - spring) / inertia[0], load + h * spring / inertia[1]
        return np.array([motor, load, twist + h * (motor - load)])

    one = np.array([step(e, 0.0) for e in np.eye(3)]).T
    push = step(np.zeros(3), 1.0)
    a, b = np.linalg.matrix_power(one, 4), sum(np.linalg.matrix_power(one, i) @ push for i in range(4))
    return np.array([np.linalg.solve(zi * np.eye(3) - a, b)[0] for zi in LINES.z])


def test_the_constant_is_worth_its_digits(drive, tmp_path):
    """Without it the offset of 30 rad/s costs float32 more than ten times the accuracy."""
    _, sent = drive
    errors = {}
    for constant, given in ((30, sent), (0, played(built(tmp_path, "-DDRIVE_VELOCITY_RAD_S=0")))):
        exact = sums_of(given.samples, "float64", 30)
        frf, truth = (s[1, SPOILT:] / s[0, SPOILT:] for s in (given.sums, exact))
        errors[constant] = np.abs(frf / truth - 1).max()
    print(
        f"float32 against float64, worst relative error of y/u: {errors[30]:.1e}, without the constant {errors[0]:.1e}"
    )
    assert errors[30] < 1e-5
    assert errors[0] > 10 * errors[30]


def test_livebode_run_makes_the_same_of_its_frames_as_of_its_samples(drive, tmp_path):
    program, sent = drive
    spectra = live_run(program, tmp_path)
    spoilt = spectra["sample"] < STEADY
    assert not np.any(spectra["valid"][spoilt])
    spectra = {name: column[~spoilt] for name, column in spectra.items()}
    samples = sent.samples[:, STEADY:]
    write_parquet(tmp_path / "log.parquet", {"t": np.arange(samples.shape[1]) / 4000} | dict(zip("uy", samples)))
    lines = '[lines]\nfrequencies = "20:220:10"\nwindow = 400\n'
    (tmp_path / "log.toml").write_text(AXIS.replace(URL, 'log = "log.parquet"') + f"hop = 200\n{lines}")
    assert livebode("run", tmp_path / "log.toml", "--all-periods", "--out", tmp_path / "recorded").code == 0
    theirs = table(tmp_path / "recorded")
    assert set(spectra) == set(theirs)
    theirs["sample"] = theirs["sample"] + STEADY
    for name in ("sample", "frequency_hz", "valid", "dof"):
        np.testing.assert_array_equal(spectra[name], theirs[name], err_msg=name)
    valid = theirs["valid"]
    assert np.count_nonzero(valid) == (SECONDS * 20 - SPOILT) * len(LINES)
    frf, truth = (rows["re"][valid] + 1j * rows["im"][valid] for rows in (spectra, theirs))
    error = np.abs(frf / truth - 1).max()
    print(f"responses from frames against those from samples, worst relative difference: {error:.1e}")
    assert error < 1e-5
    np.testing.assert_allclose(spectra["sigma"], theirs["sigma"], rtol=1e-2)


def live_run(program: Path, folder: Path) -> dict[str, np.ndarray]:
    """The responses of `livebode run` on the drive's serial line, which QEMU gives to TCP; ended by Ctrl-C."""
    port = free_port(socket.SOCK_STREAM)
    line = ("-serial", f"tcp:127.0.0.1:{port},server=on,wait=on", "-serial", "null")
    (folder / "axis.toml").write_text(AXIS.replace("5000", str(port)))
    machine = subprocess.Popen(M4F.qemu(program, *line, "-icount", "shift=4,sleep=off"), stdout=subprocess.DEVNULL)
    try:
        with started(folder / "axis.toml", folder / "live") as process:
            assert machine.wait(PATIENCE_S) == 0
            wait_read(f"tcp://127.0.0.1:{port}")
            with pytest.raises(subprocess.TimeoutExpired):
                process.wait(2.5)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=PATIENCE_S)
            assert (process.returncode, err) == (0, b"")
    finally:
        machine.kill()
    return table(folder / "live")
