"""Each name, path and alias that a recording lists is accepted by a run, as output and as input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io

from livebode.configuration import Axis
from livebode.records import RunRecord
from livebode.runtime import Destination, run
from tests.support.recordings import (
    DBC,
    NAMES,
    OWN_RATE,
    RATE_HZ,
    WRITERS,
    dspace,
    names,
    open_log,
    with_time,
    write,
    write_dspace73,
)

WINDOW = 64
OWN_UNITS = "codesys", "lvm", "mdf", "sinumerik", "svdx", "tdms", "twincat"
"""Formats that have a place for the unit, so that brackets in a name are none."""


def exchanged() -> dict[str, np.ndarray]:
    """Sixteen periods of two lines: the output is half the input one sample later."""
    time = np.arange(16 * WINDOW)
    u = np.cos(2 * np.pi * 4 * time / WINDOW) + np.sin(2 * np.pi * 9 * time / WINDOW)
    noise = np.random.default_rng(1).standard_normal((2, time.size))
    return {"input": u + 1e-3 * noise[0], "output": np.roll(u, 1) / 2 + 1e-3 * noise[1]}


def recorded(module: str, folder: Path) -> Path:
    given = exchanged()
    if module in OWN_RATE:
        return write(module, folder, given)
    if module in NAMES:
        return write(module, folder, with_time(given))
    return write(module, folder, with_time({"input [A]": given["input"], "output [rpm]": given["output"]}))


def tracked(path: Path, folder: Path, output: str, input: str) -> RunRecord:
    given = {
        "source": {"log": path, "rate_hz": RATE_HZ} | ({"dbc": dbc} if (dbc := path.with_name(DBC)).exists() else {}),
        "signals": {"output": output, "input": input},
        "lines": {"frequencies": "k=4:9:5", "window": WINDOW},
        "tracking": {"estimator": "direct", "hop": WINDOW, "trend": "keep"},  # some signals are ramps
    }
    return RunRecord.open(run(Axis.of(given, "test"), Destination(folder, lambda *_: None)).directory)


def names_of(path: Path, stem: str) -> list[str]:
    """The names that mean the channel whose name begins so, and its aliases."""
    log = open_log(path, rate_hz=RATE_HZ)
    channels = [channel.name for channel in log.channels if channel.name.startswith(stem)]
    return [*channels, *(alias for alias, name in log.aliases.items() if name in channels)]


@pytest.mark.parametrize("module", sorted(WRITERS))
def test_a_run_accepts_each_name_of_its_output(module, tmp_path):
    path = recorded(module, tmp_path)
    inputs, outputs = (names_of(path, name) for name in names(module))
    assert outputs
    for at, output in enumerate(outputs):
        found = tracked(path, tmp_path / str(at), output, inputs[at])
        assert found.summary["configuration"]["signals"]["output"] == output
        assert found.summary["found"]["unit"] == ("" if module in (*OWN_UNITS, *NAMES) else "rad/s/(A)")


@pytest.mark.parametrize("version", ["v5", "v7.3"])
def test_a_run_accepts_each_path_and_name_of_a_dspace_recording(version, tmp_path):
    path = tmp_path / "rec.mat"
    if version == "v5":
        scipy.io.savemat(path, dspace(16 * WINDOW))
    else:
        write_dspace73(path, 16 * WINDOW)
    for at, output in enumerate(["rec.Y(1).Data", "rec(1).Y(1).Data", "omega", "Model Root/Speed/omega"]):
        found = tracked(path, tmp_path / str(at), output, "iq")
        assert found.summary["found"]["unit"] == "rad/s/(A)"
