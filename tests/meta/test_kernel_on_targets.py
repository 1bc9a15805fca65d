"""The kernel as a microcontroller's linker sees it: the step needs nothing, init a short list."""

import re

import pytest

from bench.mcu import LIMIT, WORST, count
from tests.support.targets import need_tools
from tools.firmware import KERNEL, M4F, M7, ROOT, kept, run, undefined

STEP = ("push", "queue", "read", "count", "instruction_set")
# What libgcc has for a processor: divisions of 64 bits, and the double precision that a Cortex-M4F does without.
DIVISION = {"__aeabi_uldivmod", "__aeabi_ul2d"}
DOUBLE = {f"__aeabi_{name}" for name in ("dadd", "dsub", "dmul", "ddiv", "dcmplt", "dcmpgt", "dcmpeq", "ui2d", "d2f")}
ALLOWED = {M4F: DIVISION | DOUBLE, M7: DIVISION}
NAMED = {"__aeabi_ldivmod"}  # by gcc beside the unsigned one, and never called: an object lists it as undefined
PAGE = (ROOT / "docs" / "how-to" / "microcontroller.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module", params=[(M4F, "-O2"), (M4F, "-O3"), (M4F, "-Os"), (M7, "-O2"), (M7, "-O3")])
def built(request, tmp_path_factory):
    need_tools()
    core, level = request.param
    return core, core.kernel(tmp_path_factory.mktemp("kernel"), level)


def test_the_step_leaves_nothing_undefined(built, tmp_path):
    """And so has neither libm nor, on a Cortex-M4F, double precision in software."""
    core, objects = built
    file = kept(core, objects, STEP, tmp_path / "step.o")
    assert undefined(file) == set()
    functions = {line.split()[-1] for line in run("arm-none-eabi-nm", file).splitlines()}
    assert {f"lb_sdft{core.bits}_{name}" for name in STEP} <= functions


def test_init_leaves_a_short_list_undefined(built, tmp_path):
    core, objects = built
    assert undefined(kept(core, objects, ("size", "init", "reset"), tmp_path / "init.o")) <= ALLOWED[core]
    rest = ("rows", "process", "snapshot_size", "snapshot", "restore")
    assert undefined(kept(core, objects, rest, tmp_path / "rest.o")) <= ALLOWED[core]


def test_the_objects_name_what_the_page_lists_and_nothing_else(built):
    """All functions of all objects, whether a program takes them or not."""
    core, objects = built
    lines = [line.split() for line in run("arm-none-eabi-nm", *objects).splitlines()]
    defined = {words[2] for words in lines if len(words) == 3}
    named = {words[1] for words in lines if len(words) == 2 and words[0] == "U"} - defined
    assert named <= ALLOWED[core] | NAMED
    assert ALLOWED[M4F] | NAMED == set(re.findall("__aeabi_[a-z0-9]+", PAGE))


def test_the_line_stage_needs_no_library_where_the_processor_has_doubles(tmp_path):
    need_tools()
    objects = M7.compile(sorted((KERNEL / "src/lines").glob("*.c")), tmp_path, "-fno-math-errno")
    named = {line.split()[1] for line in run("arm-none-eabi-nm", "-u", *objects).splitlines() if " U " in line}
    assert named == {"lb_best_instruction_set", "lb_lines_baseline", "memcpy", "__aeabi_l2d"}


def test_no_object_rounds_once_where_others_round_twice(built):
    _, objects = built
    for file in objects:
        assert "vfm" not in run("arm-none-eabi-objdump", "-d", file), file.name


def test_the_count_is_exact_and_the_step_is_cheap(tmp_path):
    """On loops of 2n + 1 instructions, and twice the same; 600 a sample are 3 % of a 168 MHz part at 4 kHz."""
    need_tools()
    counted = count(M4F, tmp_path / "once")
    assert counted == count(M4F, tmp_path / "twice")
    assert len(counted.loops) == 6
    assert all(found == 2 * turns + 1 for turns, found in counted.loops.items())
    assert counted.kernel[21, "rows"].sample <= LIMIT
    assert counted.kernel[21, "rows"].worst <= WORST
    assert counted.kernel[21, "hop"].sample <= 0.65 * counted.kernel[21, "rows"].sample
    assert counted.kernel[21, "hop"].ram <= 0.4 * counted.kernel[21, "rows"].ram
    assert counted.kernel[21, "compact"].sample <= 1.2 * counted.kernel[21, "rows"].sample
    assert counted.kernel[21, "compact"].ram < counted.kernel[21, "rows"].ram / 4
