"""kernel/ and native/ as C: warnings, symbols, fused instructions, sanitizers, and the same bits from every build."""

import os
import re
import shutil
import signal
import subprocess
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from pathlib import Path

import pytest

from livebode.kernel import instruction_sets
from tools.stored import OF_KERNEL, compiled, state, stored, version

ROOT = Path(__file__).parents[2]
KERNEL, NATIVE = ROOT / "kernel", ROOT / "native"
WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror"]
# The flags that kernel/flags.cmake sets.
ALWAYS = ["-ffp-contract=off", "-fno-math-errno"]
SETS = {"avx2": ["-mavx2", "-mno-fma"], "avx512": ["-mavx512f", "-mavx512vl"]}
TYPED = ["layout", "rows", "stream", "read", "recur", "snapshot", "dispatch", "tiles", "one", "tile", "hops", "hop"]
INCLUDES = [f"-I{folder}" for folder in (KERNEL / "include", NATIVE / "include")]
PROGRAMS = {"misuse": KERNEL, "bits": KERNEL, "lines": KERNEL, "matrix": NATIVE, "repeating": NATIVE, "table": NATIVE}
X86 = os.uname().machine == "x86_64"
# Half of the windows, where each instruction takes many times its time.
FEW = "-DBITS_FEW_WINDOWS"
# What compilers may call in place of a loop, even in a freestanding build.
FREESTANDING = {"memcpy", "memset", "memmove", "memcmp"}


def needed(program: str) -> str:
    """A tool's path; without it the test is skipped on a laptop and fails in CI."""
    path = shutil.which(program)
    if path is None:
        message = f"{program} is not installed: `make system-packages` installs it"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    return path


def run(*command: object) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}"
    return done.stdout


def build(directory: Path, compiler: str, *flags: str, dispatch: bool = X86, spectra64: bool = False) -> list[Path]:
    """Objects of the kernel, and of native/ in a folder; `spectra64`: those that spectra of doubles need."""
    switch = ["-DLB_DISPATCH"] if dispatch else []
    jobs: list[tuple[str, str, list[str]]] = [(name, name, []) for name in ("twiddle", "machine")]
    if not spectra64:
        jobs += [("lines/lines", "lines", []), ("lines/rows", "rows", []), ("sizes", "native/sizes", [])]
        jobs += [("matrix/matrix", "native/matrix", []), ("matrix/matrices", "native/matrices", [])]
        jobs += [(f"repeating/{name}", f"native/{name}", []) for name in ("numbers", "hum", "distortion", "periods")]
        table = "nearest", "number", "moment", "read", "shortest", "write", "runs"
        jobs += [(f"table/{name}", f"native/{name}", []) for name in table]
    for name, isa in SETS.items() if dispatch else ():
        jobs.append(("lines/rows", f"rows_{name}", [f"-DLB_LINES_NAME=lb_lines_{name}", *isa]))
        jobs.append(("sizes", f"native/sizes_{name}", [f"-DLB_SIZES_NAME=lb_sizes_{name}", *isa]))
        jobs.append(("matrix/matrices", f"native/matrices_{name}", [f"-DLB_MATRIX_NAME=lb_matrix_{name}", *isa]))
    for bits in (64,) if spectra64 else (32, 64):
        jobs += [(name, f"{name}{bits}", [f"-DLB_BITS={bits}"]) for name in TYPED]
        for name, isa in SETS.items() if dispatch else ():
            kernel = f"-DLB_KERNEL_NAME=lb_sdft{bits}_kernel_{name}"
            jobs.append(("tile", f"tile{bits}_{name}", [f"-DLB_BITS={bits}", kernel, *isa]))
            hops = f"-DLB_HOPS_NAME=lb_sdft{bits}_hops_{name}"
            jobs.append(("hop", f"hop{bits}_{name}", [f"-DLB_BITS={bits}", hops, *isa]))

    def compile_one(job: tuple[str, str, list[str]]) -> Path:
        source, name, extra = job
        file = directory / f"{name}.o"
        folder, own = (NATIVE, [f"-I{KERNEL / 'src'}"]) if file.parent.name == "native" else (KERNEL, [])
        every = [*WARNINGS, *ALWAYS, *switch, *flags, *extra, *INCLUDES, *own]
        shutil.copyfile(compiled(compiler, every, folder / "src" / f"{source}.c"), file)
        return file

    (directory / "native").mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(compile_one, jobs))


def program(directory: Path, compiler: str, objects: list[Path], name: str, *flags: str, runner: str = "") -> str:
    """What a program prints; one that has run with the same objects on such a processor is not run again."""
    source = PROGRAMS[name] / "tests" / f"{name}.c"
    include = *INCLUDES, f"-I{KERNEL / 'tests'}"

    def make(file: Path) -> None:
        # Most of what the program itself does is hashing, which takes long where no compiler optimises it.
        run(compiler, *WARNINGS, "-O1", *flags, *include, source, *objects, "-o", directory / name)
        file.write_text(run(*([runner] if runner else []), directory / name), encoding="utf-8")

    content = sha256(b"".join(file.read_bytes() for file in objects)).hexdigest()
    versions = [version(one) for one in (compiler, runner) if one]
    key = [name, *versions, state(*OF_KERNEL), content, *flags, *instruction_sets()]
    return stored("\0".join(key), make).read_text(encoding="utf-8")


Built = tuple[str, Path, list[Path]]


def released(directory: Path, compiler: str) -> list[Path]:
    """Copies of the objects that `make` linked into livebode, if this compiler made them: else none."""
    found = []
    made = f"CMAKE_C_COMPILER:FILEPATH={compiler}\n", "CMAKE_BUILD_TYPE:STRING=Release\n"
    for cache in sorted(ROOT.glob("build/*/CMakeCache.txt"), key=lambda one: one.stat().st_mtime)[-1:]:
        if all(line in cache.read_text(encoding="utf-8") for line in made):
            for file in (*(cache.parent / "kernel").rglob("*.c.o"), *(cache.parent / "native").rglob("*.c.o")):
                top, source = (
                    file.relative_to(cache.parent).parts[0],
                    str(file).partition(".dir/")[2].removesuffix(".o"),
                )
                # What fits models may call libm; an object whose source has moved is of an earlier build.
                if file.parent.name not in ("fit", "belt") and (ROOT / top / source).exists():
                    folder = next(part for part in file.parts if part.endswith(".dir"))
                    _, kind, *rest = folder.removesuffix(".dir").split("_")
                    name = file.name.removesuffix(".c.o") + "_" * (kind != "tile" and "avx" in folder) + "_".join(rest)
                    target = directory / ("native" if kind == "native" else "") / f"{name}.o"
                    found.append(Path(shutil.copy(file, target)))
    return found


def as_released(name: str, directory: Path) -> Built:
    """The C as it is released, by a named compiler. What `make` has built is not built again."""
    compiler = needed(name)
    (directory / "native").mkdir(parents=True)
    objects = released(directory, compiler) or build(directory, compiler, "-O3", "-ffreestanding")
    return compiler, directory, sorted(objects)


@pytest.fixture(scope="module", params=["gcc", "clang"])
def built(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Built:
    return as_released(request.param, tmp_path_factory.mktemp("built") / request.param)


def test_no_object_holds_a_fused_multiply_add(built):
    assembly = run(needed("objdump"), "-d", *built[2])
    assert not re.search(r"\bv?fn?m(add|sub)", assembly), "it rounds once where others round twice"


def test_wide_objects_use_wide_registers(built):
    if not X86:
        pytest.skip("instruction sets are x86-64's")
    for name, register in (("avx2", "ymm"), ("avx512", "zmm")):
        for bits, suffix in ((32, "ps"), (64, "pd")):
            for part in ("tile", "hop"):
                (file,) = (f for f in built[2] if f.name == f"{part}{bits}_{name}.o")
                assembly = run(needed("objdump"), "-d", file)
                assert len(re.findall(rf"vmul{suffix} .*%{register}", assembly)) > 20
        for stage, least in (("rows", 5), ("matrices", 1)):
            (file,) = (f for f in built[2] if f.name == f"{stage}_{name}.o")
            assert len(re.findall(rf"vdivpd .*%{register}", run(needed("objdump"), "-d", file))) > least


def test_undefined_symbols_are_few_and_known(built):
    """What is in kernel/ needs nothing of native/ either."""
    allowed = FREESTANDING | ({"__cpu_model", "__cpu_indicator_init", "_GLOBAL_OFFSET_TABLE_"} if X86 else set())
    for objects in (built[2], [file for file in built[2] if file.parent.name != "native"]):
        own, expected = set(), set()
        for line in run(needed("nm"), "--print-file-name", *objects).splitlines():
            kind, name = line.split()[-2:]
            (expected if kind == "U" else own).add(name)
        assert expected - own <= allowed


def test_misuse_is_refused(built, tmp_path):
    compiler, _, objects = built
    program(tmp_path, compiler, objects, "misuse")


def test_same_bits_from_every_compiler_level_and_width(tmp_path):
    builds = {name: as_released(name, tmp_path / name) for name in ("gcc", "clang")}
    for name, flags in {
        "gcc one by one": ["-O2", "-DLB_SCALAR"],
        "clang one by one, with assertions": ["-O1", "-DLB_SCALAR", "-DLB_DEBUG"],
    }.items():
        compiler = needed(name.split()[0])
        builds[name] = compiler, tmp_path, build(tmp_path / name, compiler, *flags, dispatch=False)
    hashes = {}
    for name, (compiler, _, objects) in builds.items():
        (tmp_path / f"run {name}").mkdir()
        hashes[name] = tuple(
            program(tmp_path / f"run {name}", compiler, objects, part) for part in PROGRAMS if part != "misuse"
        )
    assert len(set(hashes.values())) == 1, hashes


def test_arm_has_vectors_and_the_same_bits(tmp_path):
    """AArch64 in QEMU: the vectors are NEON's from the same source, and no product is fused with a sum."""
    compiler, emulator = needed("aarch64-linux-gnu-gcc"), needed("qemu-aarch64")
    objects = build(tmp_path / "objects", compiler, "-O1", dispatch=False)
    assembly = run("aarch64-linux-gnu-objdump", "-d", *objects)
    assert not re.search(r"\bfn?m(la|ls|add|sub)\b", assembly)
    inner = (file for file in objects if file.stem in ("tile32", "tile64", "hop32", "hop64"))
    of_rows = run("aarch64-linux-gnu-objdump", "-d", *inner)
    for elements in ("4s", "2d"):
        assert len(re.findall(rf"fmul\s+v\d+\.{elements}", of_rows)) > 100
    host, _, of_host = as_released("gcc", tmp_path / "of the host")
    (tmp_path / "host").mkdir()
    made = program(tmp_path, compiler, objects, "bits", FEW, "-static", runner=emulator)
    assert made == program(tmp_path / "host", host, of_host, "bits", FEW)


def test_sanitizers_find_nothing(tmp_path):
    # gcc alone: Debian's clang comes without the sanitizers' run-time library.
    sanitize = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    compiler = needed("gcc")
    # The same statements, and every check in each of them, but no object repeats a function wherever it is called.
    flags = ["-Og", "-fno-inline", "-DLB_DEBUG", "-DLB_INLINE=static inline"]
    objects = build(tmp_path / "objects", compiler, *flags, *sanitize)
    for part in PROGRAMS:
        program(tmp_path, compiler, objects, part, *([FEW] if part == "bits" else []), *sanitize)


VIOLATIONS = {
    "index": "t->index == t->count",
    "count": "t->index == t->count",
    "blocks": "t->blocks ==",
    "table": "t->half ==",
    "queued": "t->queued <=",
    "radius": "t->radius_window <=",
    "overlap": "lb_apart",
}


def violating(directory: Path, *flags: str) -> Path:
    """A program that violates what its argument names, with a debug build of the kernel."""
    compiler = needed("gcc")
    objects = build(directory, compiler, "-O0", "-DLB_SCALAR", "-DLB_DEBUG", *flags, dispatch=False, spectra64=True)
    include = [f"-I{KERNEL / folder}" for folder in ("include", "src")]
    define = ["-DLB_BITS=64", "-DLB_SCALAR", "-DLB_DEBUG", *flags]
    run(compiler, *WARNINGS, *define, *include, KERNEL / "tests/violation.c", *objects, "-o", directory / "violation")
    return directory / "violation"


def test_a_debug_build_traps_where_an_invariant_is_violated(tmp_path):
    program = violating(tmp_path / "trap")
    assert subprocess.run([program, "none"], check=False).returncode == 0
    for what in VIOLATIONS:
        assert -subprocess.run([program, what], check=False).returncode in (signal.SIGILL, signal.SIGTRAP), what


def test_a_handler_receives_the_condition_that_is_violated(tmp_path):
    program = violating(tmp_path / "handler", "-DLB_ASSERT_HANDLER=violated")
    for what, condition in VIOLATIONS.items():
        done = subprocess.run([program, what], capture_output=True, text=True, check=False)
        assert done.returncode == 42, what
        assert "lb_sound(t)" in done.stdout or condition in done.stdout, what


def test_a_release_has_no_code_for_assertions(tmp_path):
    # Without optimisation: no compiler has removed code that was there, and none has to be run to remove it.
    flags = ["-O0", "-DLB_SCALAR"]
    with_them = build(tmp_path / "with", needed("gcc"), *flags, dispatch=False)
    none = ["-DLB_ASSERT_H", "-DLB_ASSERT(condition)=((void)0)"]
    without = build(tmp_path / "without", needed("gcc"), *flags, *none, dispatch=False)
    for one, other in zip(with_them, without):
        assert one.read_bytes() == other.read_bytes(), one.name


def test_the_documented_example_compiles_and_runs(built, tmp_path):
    compiler, _, objects = built
    text = (ROOT / "docs" / "reference" / "kernel.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```c\n(.*?)```", text, re.S)
    (expected,) = re.findall(r"```text prints\n(.*?)```", text, re.S)
    source = tmp_path / "example.c"
    source.write_text(example, encoding="utf-8")
    run(compiler, *WARNINGS, f"-I{KERNEL / 'include'}", source, *objects, "-o", tmp_path / "example")
    assert run(tmp_path / "example") == expected


def test_the_header_is_also_cpp(tmp_path):
    source = tmp_path / "header.cpp"
    source.write_text('#include "livebode/repeating.h"\nint main() { return lb_best_instruction_set() == LB_BEST; }\n')
    run(needed("g++"), "-Wall", "-Wextra", "-Werror", *INCLUDES, "-c", source, "-o", tmp_path / "o")
