"""What the pages show works: Python runs, TOML is a configuration, commands and options exist.

The cells of the tutorials have a test of their own; the C of docs/reference/kernel.md is compiled by a test
of the kernel.
"""

from __future__ import annotations

import re
import shlex
import socket
import threading
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import typer

from livebode import BeltAxis, Block, Lines, Settings, SimulatedAxis, Strokes, Tracker, multisine
from livebode.cli import app
from livebode.configuration import Axis
from livebode.configuration.axes import merged, tables_of
from livebode.fitting import Parameter, PhysicalModel
from livebode.simulation import Sensor, Standstill
from livebode.simulation.faults import OverTime
from livebode.sources.live import Batch, encode_layout, encode_samples

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]
LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)
SMALLEST = {"source": {"log": "log.parquet"}, "signals": {"output": "y", "input": "u", "excitation": "w"}}
HELD = Standstill(position_m=0.8)
LIVE = "udp://0.0.0.0:5000"
NEEDS_A_FILE = "gantry.fmu"
"""A model of another program: its snippet is only compiled; tests/simulation run such models."""


def blocks_of(page: Path, language: str) -> list[str]:
    """The blocks of code of this language, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S)


def name_of(page: object) -> str:
    return str(page.relative_to(ROOT)) if isinstance(page, Path) else ""


def simulated(seed: int, seconds: float = 3.5, motion: Standstill | Strokes = HELD) -> Block:
    sensor = Sensor(noise_rad_per_s=0.1)
    axis = BeltAxis(motion=motion, excitation_n_m=multisine(LINES), sensor=sensor, seconds=seconds, seed=seed)
    return SimulatedAxis(axis).run()[0]


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with the recordings, runs and the baseline that the pages name."""
    folder = tmp_path_factory.mktemp("workshop")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for seed, names in enumerate((["log", "axis"], ["today"]), 1):
            block = simulated(seed)
            table = {"t": np.arange(len(block)) / block.rate_hz} | {name: block[name] for name in block.names}
            table |= {
                "x": np.full(len(block), 0.8),
                "y": block["velocity"],
                "iq": block["u"],
                "omega": block["velocity"],
            }
            for name in names:
                pq.write_table(pa.table(table), f"{name}.parquet")
        roles = "--excitation w --input u --output velocity --schedule x --lines 20:140:20 --window 400"
        loop = "[loop.velocity]\ngain = 0.2308\nintegral_time_s = 0.2\nrate_hz = 4000\n"
        for log, run in (("log", "monday"), ("today", "tuesday")):
            Path(f"{run}.toml").write_text(f'[source]\nlog = "{log}.parquet"\n[signals]\noutput = "velocity"\n{loop}')
            app(shlex.split(f"run {run}.toml {roles} --out runs/{run}"), standalone_mode=False)
        app(shlex.split("learn runs/monday runs/tuesday --out healthy.json"), standalone_mode=False)
    return folder


@pytest.fixture
def sender() -> Iterator[str]:
    """The url of a machine that sends half a second of samples."""
    block = simulated(1, 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def send() -> None:
            connection, _ = server.accept()
            with connection:
                connection.sendall(encode_layout(block.channels, block.rate_hz, epoch=1, sequence=0))
                batch = Batch(0, np.array(block.data), block.channels, block.rate_hz, epoch=1)
                connection.sendall(encode_samples(batch, sequence=0))

        thread = threading.Thread(target=send)
        thread.start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        thread.join()


@pytest.fixture
def names() -> dict[str, Any]:
    """What a snippet takes for granted."""
    settings = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x")
    responses = Tracker(settings).process(simulated(1, 1.0))
    moving = simulated(1, 4.3, Strokes(speed_m_per_s=0.38))
    given = (np, dataclass, OverTime, PhysicalModel, Parameter, multisine)
    names: dict[str, Any] = {value.__name__: value for value in given} | {"np": np, "lines": LINES}
    return names | {"blocks": [moving], "batches": [responses], "response": responses[-1]}


@pytest.mark.parametrize("page", [page for page in PAGES if blocks_of(page, "python")], ids=name_of)
def test_the_python_of_a_page_runs(
    page: Path, workshop: Path, names: dict[str, Any], request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the first block to the last, as a reader would."""
    monkeypatch.chdir(workshop)
    for number, text in enumerate(blocks_of(page, "python"), 1):
        if LIVE in text:
            text = text.replace(LIVE, request.getfixturevalue("sender")) + "        break\n"  # a live source never ends
        code = compile(text, f"{page.name}, block {number}", "exec")
        if NEEDS_A_FILE not in text:
            exec(code, names)


TOML = [
    pytest.param(text, id=f"{name_of(page)}-{n}") for page in PAGES for n, text in enumerate(blocks_of(page, "toml"))
]


@pytest.mark.parametrize("text", TOML)
def test_the_toml_of_a_page_is_a_configuration(text: str) -> None:
    """Alone where it has signals, otherwise with the smallest configuration around it."""
    data = tomllib.loads(text)
    below = {} if "signals" in data else SMALLEST | ({"source": {}} if "source" in data else {})
    for table in tables_of(merged(below, data), "axis.toml").values():
        assert Axis.of(table, "axis.toml")


COMMANDS = [
    pytest.param(command, id=f"{name_of(page)}: {command[:60]}")
    for page in PAGES
    for command in re.findall(
        r"^    (?:\$ )?livebode ([a-z-][^:]+?)$", page.read_text("utf-8").replace("\\\n", " "), re.M
    )
]


@pytest.mark.parametrize("text", COMMANDS)
def test_a_command_of_a_page_and_its_options_exist(text: str) -> None:
    group: Any = typer.main.get_command(app)
    words = re.split(r"[\s\[\]|]+", text.split(" #")[0])
    command = next((group.commands[word] for word in words if word in group.commands), group)
    known = {name for options in (group, command) for parameter in options.params for name in parameter.opts}
    assert command is not group or words == ["--help"], text
    assert {word for word in words if word.startswith("-")} <= known, text
