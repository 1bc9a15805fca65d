"""The example and the pages show what the generator writes."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np

from livebode.configuration import Axis
from livebode_drives.live.ads import FILETIME_1970, HEADER, read_ring
from livebode_drives.structured_text.project import ring_block, ring_type
from tests.support.command import livebode
from tools.structured_text import Instance, Machine
from tools.structured_text.types import ULINT

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "examples/plc"


def test_the_example_is_what_its_command_writes(tmp_path: Path) -> None:
    axis = EXAMPLE / "axis.toml"
    command = re.search(r"^#\s+livebode (plc .*) --out", axis.read_text(), re.M).group(1)
    arguments = [str(axis) if word.endswith(".toml") else word for word in command.split()]
    assert livebode(*arguments, "--out", tmp_path).code == 0
    for path in EXAMPLE.glob("*.st"):
        assert path.read_text() == (tmp_path / path.name).read_text()
    assert len(list(EXAMPLE.glob("*.st"))) == len(list(tmp_path.iterdir()))


def test_the_example_runs_and_its_configuration_names_the_rings_columns() -> None:
    texts = [path.read_text() for path in EXAMPLE.glob("*.st")]
    machine = Machine(*texts, functions={"F_GETSYSTEMTIME": (ULINT, lambda: FILETIME_1970)})
    program = machine.instance("MAIN")
    program["enable"] = True
    for _ in range(250):
        program()
    raw = Instance(machine.units["st_livebodering"], program.memory.v_livebode).bytes()
    ring, dtype = read_ring(raw, len(raw))
    names = [heading.split(" [")[0] for heading in Axis.read(EXAMPLE / "axis.toml").source.channels]
    rows = np.frombuffer(raw, dtype, offset=HEADER.size).reshape(ring.length, ring.channels)[: ring.count]
    assert len(names) == ring.channels
    np.testing.assert_array_equal(rows[:, names.index("sample")], np.arange(250))
    assert np.any(rows[200:, names.index("w")])


def test_the_page_on_live_sources_shows_the_ring_that_is_generated_and_read() -> None:
    page = (ROOT / "docs/how-to/live.md").read_text()
    ring_text, main = re.findall(r"```iecst\n(.*?)```", page, re.S)
    source = tomllib.loads(re.search(r"```toml\n(\[source\]\nurl = \"ads:.*?)```", page, re.S).group(1))["source"]
    names = [heading.split(" [")[0] for heading in source["channels"]]
    assert ring_text == ring_type(len(names), 4000) + "\n" + ring_block(names)
    machine = Machine(ring_text, main, functions={"F_GETSYSTEMTIME": (ULINT, lambda: FILETIME_1970)})
    program = machine.instance("MAIN")
    for n in range(3):
        program["velocity"] = float(n)
        program()
    ring = machine.units["st_livebodering"]
    raw = Instance(ring, program.memory.v_livebode).bytes()
    found, dtype = read_ring(raw, len(raw))
    assert found.count == 3
    assert source["symbol"] == "MAIN.livebode"
    rows = np.frombuffer(raw, dtype, offset=HEADER.size).reshape(-1, 2)
    np.testing.assert_array_equal(rows[:3, 1], [0.0, 1.0, 2.0])
