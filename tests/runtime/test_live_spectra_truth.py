"""`livebode run` on a drive that sends spectra: the same responses, fits, alarms and records as from its samples."""

from __future__ import annotations

import json
import signal
import subprocess
import time
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.configuration import Axis
from livebode.core import Block, Channel, ConfigError, GridError, Lines, SpectraLayout
from livebode.estimation import Settings
from livebode.excitation import multisine
from livebode.preparation.followers import check_spectra
from livebode.records import RunRecord
from livebode.runtime.change_detection import change_detection
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis, TensionLoss
from livebode.sources.live import SpectraBatch, encode_spectra, encode_spectra_layout
from livebode.sources.live.kernel_drive import KernelDrive
from tests.support.command import livebode, write_parquet
from tests.support.errors import refused
from tests.support.forked import Command
from tests.support.live_runs import assert_recorded, started, table
from tests.support.monitored import small_baseline
from tests.support.peers.broker import MqttPeer
from tests.support.peers.peer import PATIENCE_S, Peer, fed
from tests.support.peers.plain import TcpPeer, UdpPeer, wait_read

LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)
SIGNALS = (Channel("velocity", "rad/s"), Channel("u", "N m"), Channel("w", "N m"))
HOP = 200
REST = """
[signals]
excitation = "w"
input = "u"
output = "velocity"
schedule = "x"
[tracking]
noise = "quiet"
"""
LINES_SAID = """
[lines]
frequencies = "20:140:20"
window = 400
"""
FIT = """
[fit]
model = "two-mass"
radius_m = 0.019
"""


def layout(hop: int = HOP, **options: Any) -> SpectraLayout:
    given: dict[str, Any] = {"quiet": (1, *LINES.quiet, 15, 16, 17, 18)} | options
    return SpectraLayout(SIGNALS, (Channel("x", "m"),), LINES.window, hop, LINES.bins, **given)


@cache
def record(loss: float = 0.0, seconds: float = 8.0) -> Block:
    """The belt axis at a standstill, its belt looser from the half on; float32, as a drive has it."""
    axis = BeltAxis(
        excitation_n_m=multisine(LINES), sensor=Sensor(noise_rad_per_s=0.01), seconds=seconds, run_in_s=5, seed=4,
        faults=(TensionLoss(start_s=seconds / 2, loss=loss),) if loss else (),
    )  # fmt: skip
    block, _ = SimulatedAxis(axis).run()
    return block


def frames(block: Block, what: SpectraLayout, samples: int = HOP) -> list[SpectraBatch]:
    pieces = (block.cut(at, at + samples) for at in range(0, len(block), samples))
    return list(KernelDrive(what).spectra(pieces, epoch=9))


def of_spectra(kind: type[Peer], folder: Path, what: SpectraLayout, at_port: int = 0) -> Peer:
    """A peer of this kind whose layout is that of spectra."""
    text = encode_spectra_layout(what, 4000.0, epoch=9)

    class Drive(kind):
        layout = text
        port = at_port

        def send(self, batch: SpectraBatch) -> None:
            self.send_frame(encode_spectra(batch))

        def send_frame(self, frame: bytes) -> None:
            {
                UdpPeer: lambda: self._socket.send(frame),
                TcpPeer: lambda: self._link.sendall(frame),
                MqttPeer: lambda: self._publish(frame),
            }[kind]()

        def wait_ready(self) -> None:
            super().wait_ready()
            self.send_frame(text)

    return Drive(folder)


@pytest.mark.parametrize("kind", [UdpPeer, TcpPeer, MqttPeer])
def test_the_same_spectra_come_over_every_transport(tmp_path: Path, kind: type[Peer]) -> None:
    given = frames(record(), layout())
    with of_spectra(kind, tmp_path, layout()) as peer:

        def script() -> None:
            peer.wait_ready()
            for batch in given:
                peer.send(batch)
                time.sleep(0.001)

        with fed(peer, script) as source:
            assert source.spectra == layout()
            assert source.rate_hz == 4000.0
            blocks = []
            for block in source.blocks(["velocity", "x"]):
                blocks.append(block)
                if block.stop == len(given) * HOP:
                    break
    assert [block.stop for block in blocks[:-1]] == [block.start for block in blocks[1:]]
    assert {block.names for block in blocks} == {("velocity", "x")}
    sums, x = np.concatenate([block.sums for block in blocks], axis=1), np.concatenate([block["x"] for block in blocks])
    np.testing.assert_array_equal(sums, np.concatenate([batch.sums for batch in given], axis=1))
    np.testing.assert_array_equal(x, np.float32(np.concatenate([batch.values[0] for batch in given])))


def run_live(
    folder: Path, name: str, sent: list[SpectraBatch], config: str, kind: type[Peer] = TcpPeer, pause_s: float = 0.002
) -> tuple[dict[str, Any], Path]:
    """A process of `livebode run` on a drive that sends these, ended by Ctrl-C when all are recorded."""
    with of_spectra(kind, folder, sent[0].layout) as peer:
        path = folder / f"{name}.toml"
        path.write_text(f'[source]\nurl = "{peer.settings["url"]}"\n{config}')
        with started(path, folder / name) as process:
            peer.wait_ready()
            for batch in sent:
                peer.send(batch)
                time.sleep(pause_s)
            out = ended(process, peer)
    return json.loads(out), folder / name


def ended(process: Command, peer: Peer, message: bytes = b"") -> bytes:
    """Its output after Ctrl-C, sent when it has read everything; `message` is how its errors begin."""
    wait_read(peer.settings["url"])
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(2.0)  # it goes on, for the machine may send more
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, err[: len(message) or None]) == (0, message)
    return out


def recorded(folder: Path, config: str, block: Block) -> Path:
    """The run of the same samples, its kernel in float32."""
    columns = {"t": np.arange(len(block)) / block.rate_hz} | {name: block[name] for name in ("w", "u", "velocity", "x")}
    write_parquet(folder / "log.parquet", columns)
    path = folder / "log.toml"
    text = config.replace("[tracking]", f'{LINES_SAID}[tracking]\ndtype = "float32"\nhop = {HOP}')
    path.write_text(f'[source]\nlog = "log.parquet"\n{text}')
    result = livebode("run", path, "--out", folder / "recorded")
    assert result.code == 0, result.err
    return folder / "recorded"


@pytest.mark.parametrize("kind", [UdpPeer, TcpPeer])
def test_a_run_on_spectra_is_the_run_on_the_samples(tmp_path: Path, kind: type[Peer]) -> None:
    config = REST + (FIT if kind is TcpPeer else "")
    # Fits have a budget of real time: beside them the drive sends at its own pace.
    pause_s = HOP / record().rate_hz if kind is TcpPeer else 0.002
    summary, out = run_live(tmp_path, "live", frames(record(), layout()), config, kind, pause_s)
    theirs, ours = table(recorded(tmp_path, config, record())), table(out)
    np.testing.assert_allclose(ours["schedule"], theirs["schedule"], rtol=2.0**-24)
    assert_recorded(ours, theirs, but=["schedule"])
    assert summary["counts"]["samples"] == len(record())
    assert summary["found"]["from"] == "spectra"
    assert summary["found"]["quiet_bins"] == list(LINES.quiet)
    assert summary["source"]["lost"] == 0
    assert (out / "bode.svg").is_file()
    if kind is TcpPeer:
        mine, other = (table(folder, "parameters") for folder in (out, tmp_path / "recorded"))
        assert mine.keys() == other.keys()
        assert len(mine["value"]) > 100
        mine_at, other_at = (np.lexsort((rows["name"], rows["sample"])) for rows in (mine, other))
        for name in other.keys() - {"schedule"}:
            np.testing.assert_array_equal(mine[name][mine_at], other[name][other_at], err_msg=name)
        newest, theirs = summary["fit"]["newest"], RunRecord.open(tmp_path / "recorded").summary["fit"]["newest"]
        assert newest | {"schedule": None} == theirs | {"schedule": None}


def test_a_run_continues_after_lost_frames_and_after_its_end(tmp_path: Path) -> None:
    given = frames(record(), layout())
    _, out = run_live(tmp_path, "live", [b for at, b in enumerate(given[:60]) if at not in (20, 21)], REST)
    config = (tmp_path / "live.toml").read_text()
    summary = json.loads((out / "run.json").read_text())
    assert summary["counts"]["missing"] == summary["source"]["lost"] == 2 * HOP
    assert [e["kind"] for e in events(out)] == ["connected", "loss", "gap"]
    # The same machine, begun anew, where the same configuration looks for it.
    port = int(config.split('"')[1].rsplit(":", 1)[1])
    with of_spectra(TcpPeer, tmp_path, layout(), port) as peer, started(tmp_path / "live.toml", out) as process:
        peer.wait_ready()
        for batch in given:
            peer.send(replace(batch, epoch=10))
        ended(process, peer, b"livebode: the record continues at sample 12000")
    rows = table(out)
    sample = rows["sample"][:: len(LINES)]
    assert np.all(np.diff(sample) > 0)
    assert np.all((sample + 1) % HOP == 0)
    assert len(sample) == 58 + len(given)
    at = np.flatnonzero(np.diff(sample) > 3 * HOP)
    assert at.tolist() == [57]  # where it was away
    theirs = table(recorded(tmp_path, REST, record()))
    for name in ("re", "im"):
        np.testing.assert_array_equal(rows[name][58 * len(LINES) :], theirs[name])


def events(out: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (out / "events.jsonl").read_text().splitlines()]


def test_a_baseline_learned_from_samples_detects_a_change_in_spectra(tmp_path: Path) -> None:
    config = REST.replace('schedule = "x"\n', "")
    healthy = recorded(tmp_path, config, record(seconds=40.0))
    learned = livebode("learn", healthy, "--out", tmp_path / "healthy.json")
    assert learned.code == 0, learned.err
    assert "learn with a hop of 80 or less" in learned.out
    what = replace(layout(), values=())
    config += '[monitoring]\nbaseline = "healthy.json"\n'
    changed, out = run_live(tmp_path, "changed", frames(record(0.1), what), config)
    assert changed["monitoring"]["judged_by"] == "tables"
    assert [e["details"]["what"] for e in events(out) if e["kind"] == "change"] == ["lines"]
    same, out = run_live(tmp_path, "same", frames(record(), what), config)
    assert same["monitoring"]["changes"] == 0
    # And spectra are as good to learn from.
    learned = livebode("learn", out, "--out", tmp_path / "spectra.json")
    assert learned.code == 0, learned.err


def test_the_model_of_the_machine_is_left_out_and_this_is_reported(tmp_path: Path) -> None:
    small_baseline().save(tmp_path / "baseline.json")
    axis = configured(REST + f'[monitoring]\nbaseline = "{tmp_path / "baseline.json"}"\n')
    tracker_settings = settings()
    summary = change_detection(axis, tracker_settings, samples=False).summary()
    assert summary["judged_by"] == "tables"
    assert "model of the machine is not used: it needs samples at regular times" in summary["message"]
    assert change_detection(axis, tracker_settings).summary()["judged_by"] == "model"


def settings() -> Settings:
    return Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x", noise="quiet", hop=HOP)


def configured(text: str) -> Axis:
    return Axis.of(tomllib.loads('[source]\nurl = "udp://h:1"\n' + text), "the test")


@pytest.mark.parametrize(
    ("more", "code", "facts"),
    [
        ("[motion]\nradius_m = 0.019\n", "needs-samples", {"key": "motion"}),
        ("[record]\nsamples = true\n", "needs-samples", {"key": "record.samples"}),
        ("[lines]\nwindow = 800\n", "value-mismatch", {"key": "lines.window", "value": 800, "allowed": 400}),
        ('[lines]\nfrequencies = "20:120:20"\n', "value-mismatch",
         {"key": "lines.frequencies", "value": "20:120:20", "allowed": "20, 40, 60, 80, 100, 120, 140 Hz"}),
        ("hop = 20\n", "value-mismatch", {"key": "tracking.hop", "value": 20, "allowed": 200}),
    ],
)  # fmt: skip
def test_settings_that_the_frames_contradict_are_refused(more: str, code: str, facts: dict) -> None:
    with refused(ConfigError, code, **facts):
        check_spectra(configured(REST + more), layout(), 4000.0)


def test_a_line_off_the_grid_of_the_frames_is_refused() -> None:
    with refused(GridError, "line-off", frequency_hz=25.0, resolution_hz=10.0):
        check_spectra(configured(REST + '[lines]\nfrequencies = "25"\n'), layout(), 4000.0)


def test_lines_are_taken_from_the_frames_or_must_be_theirs() -> None:
    for more in ("", "[lines]\nwindow = 400\n", '[lines]\nfrequencies = "20:140:20"\nwindow = 400\n', "hop = 200\n"):
        assert check_spectra(configured(REST + more), layout(), 4000.0) == LINES
