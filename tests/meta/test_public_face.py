"""The public face is what it says, loads lazily, and documents every argument that exists."""

from __future__ import annotations

import dataclasses
import doctest
import inspect
import io
import pkgutil
import pydoc
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

import pytest

import livebode
from livebode.plugins import named

COMMANDS = named("commands")
ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "livebode"
PAGE = ROOT / "docs" / "reference" / "python.md"
FACES = [
    "livebode",
    *(f"livebode.{path.parent.name}" for path in sorted(SOURCE.glob("*/__init__.pyi"))),
    "livebode_design",
    "livebode_matrix",
    "livebode_modes",
]
SHARED = {"livebode.kernel._native", "livebode.simulation._axis"}
"""Private modules that another package may import: the C of the tables is in the kernel's extension module, and the C
engine of the simulation also replays a recorded motion."""


def test_every_public_name_exists_and_is_listed_once() -> None:
    assert livebode.__all__ == sorted(set(livebode.__all__))
    for name in livebode.__all__:
        assert getattr(livebode, name).__doc__, name
    assert set(livebode.__all__) <= set(dir(livebode))
    with pytest.raises(AttributeError, match="'Trakcer'"):
        _ = livebode.Trakcer


def test_importing_livebode_loads_nothing_heavy_and_a_response_nothing_that_draws_or_converts() -> None:
    code = """
import sys, livebode
heavy = {'numpy', 'scipy', 'matplotlib', 'pyarrow', 'pandas', 'xarray', 'control', 'html'}
print(sorted(heavy & set(sys.modules)))
livebode.Response, livebode.Responses
print(sorted(heavy & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[]", "['numpy']"]


@pytest.mark.parametrize("word", ["--version", "--help"])
def test_version_and_help_load_nothing_but_the_first_page(word: str) -> None:
    code = f"import sys; from livebode.cli import main; sys.argv[1:] = [{word!r}]; main(); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.splitlines()[-1].split())
    heavy = {"numpy", "scipy", "pyarrow", "matplotlib", "pydantic", "starlette", "typer", "rich", "logging"}
    assert loaded & heavy == set()
    assert {name for name in loaded if name.startswith("livebode.")} <= {
        "livebode.version", "livebode.on_first_use", "livebode.cli", "livebode.cli.start", "livebode.cli.first_page",
        "livebode.cli.frames", "livebode.cli.commands", "livebode.plugins",
    }  # fmt: skip


@pytest.mark.parametrize("words", [[name, "--help"] for name in named("commands")] + [["rn"], ["run", "--nonsense"]])
def test_the_help_of_a_command_and_a_wrong_one_load_no_library_but_typer(words: list[str]) -> None:
    code = f"""
import sys
from livebode.cli import main
sys.argv[1:] = {words!r}
try:
    main()
except SystemExit:
    print(*sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.splitlines()[-1].split())
    heavy = {"numpy", "scipy", "pyarrow", "matplotlib", "pydantic", "starlette", "rich", "fsspec", "asyncio"}
    assert "typer" in loaded
    assert loaded & heavy == set()


def test_the_package_has_the_version_that_is_published() -> None:
    published = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert livebode.__version__ == published


def test_the_command_line_starts_without_what_most_commands_do_not_need() -> None:
    code = """
import sys, livebode.cli.app
heavy = {'matplotlib', 'pandas', 'uvicorn'}
heavy |= {f'scipy.{name}' for name in ('linalg', 'optimize', 'signal', 'special', 'stats')}
print(sorted(heavy & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[0] == "[]"


@pytest.mark.parametrize("name", [n for n in livebode.__all__ if inspect.isclass(getattr(livebode, n))])
def test_every_documented_parameter_exists(name: str) -> None:
    thing = getattr(livebode, name)
    section = re.search(r"Parameters\n-+\n(.*?)(?:\n\n[A-Z][a-z]+\n-+\n|\Z)", inspect.getdoc(thing) or "", re.S)
    if section is None:
        return
    names = [name for line in re.findall(r"^(\S.*)$", section.group(1), re.M) for name in line.split(",")]
    documented = {name.strip().lstrip("*") for name in names}
    known = set(inspect.signature(thing).parameters)
    if dataclasses.is_dataclass(thing):
        known |= {field.name for field in dataclasses.fields(thing)}
    assert documented <= known, documented - known


@pytest.mark.parametrize("name", livebode.__all__)
def test_every_public_name_has_an_example_that_runs(name: str) -> None:
    doc = inspect.getdoc(getattr(livebode, name)) or ""
    example = doc.partition("Examples\n--------\n")[2]
    assert doctest.DocTestParser().get_examples(example), name


@pytest.mark.parametrize("name", [name for name in livebode.__all__ if name.endswith("Error")])
def test_the_example_of_an_error_runs(name: str) -> None:
    """doctest finds the others in their modules; errors name `livebode` as theirs, and are not found there."""
    doc = inspect.getdoc(getattr(livebode, name)) or ""
    example = doctest.DocTestParser().get_doctest(doc, {}, name, None, None)
    report = io.StringIO()
    assert doctest.DocTestRunner().run(example, out=report.write).failed == 0, report.getvalue()


@pytest.mark.parametrize("name", [name for name in livebode.__all__ if not name.endswith("Error")])
def test_the_example_of_another_name_is_found_by_doctest(name: str) -> None:
    thing = getattr(livebode, name)
    found = doctest.DocTestFinder(recurse=False).find(thing, name, module=sys.modules[thing.__module__])
    assert [test for test in found if test.examples]
    assert vars(sys.modules[thing.__module__])[thing.__name__] is thing


def test_the_page_of_the_public_interface_lists_every_name_and_package() -> None:
    page = PAGE.read_text("utf-8")
    rows = [line.split("|")[1:3] for line in page.splitlines() if line.startswith("| `")]
    names = {name for cells in rows for name in re.findall(r"`(\w+)`", cells[0])}
    packages = {name for cells in rows for name in re.findall(r"`livebode\.(\w+)`", cells[0])}
    assert names == set(livebode.__all__)
    have = {path.parent.name for path in SOURCE.glob("*/__init__.py") if "__all__" in path.read_text("utf-8")}
    assert packages == have - {"cli"}
    for package in packages:
        module = import_module(f"livebode.{package}")
        assert [name for name in module.__all__ if not hasattr(module, name)] == [], package


def test_help_begins_with_a_page_that_names_every_name() -> None:
    page = pydoc.plain(pydoc.render_doc(livebode)).partition("PACKAGE CONTENTS")[0]
    assert [name for name in livebode.__all__ if not re.search(rf"\b{name}\b", page)] == []
    assert max(map(len, page.splitlines())) <= 125


def _callables() -> Iterator[tuple[str, Callable[..., object]]]:
    """Public functions, classes, and their public methods; C functions have no signature and take no keywords."""
    for name in livebode.__all__:
        thing = getattr(livebode, name)
        yield name, thing
        for method in dir(thing) if inspect.isclass(thing) else ():
            if not method.startswith("_") and callable(getattr(thing, method)):
                yield f"{name}.{method}", getattr(thing, method)


@pytest.mark.parametrize(
    "callable_",
    [
        pytest.param(callable_, id=name)
        for name, callable_ in _callables()
        # Facts of an error have any name; the options of a fit are those of its model, as the next test shows.
        if not (
            name.split(".")[0].endswith(("Error", "Warning")) or name in ("fit", "Fitter", "Model", "PhysicalModel")
        )
    ],
)
def test_every_misspelt_keyword_raises(callable_: Callable[..., object]) -> None:
    with pytest.raises(TypeError, match=r"spelt_wrong|takes no keyword arguments|incompatible function arguments"):
        callable_(spelt_wrong=1)


def test_a_misspelt_option_of_a_model_raises() -> None:
    for call in (livebode.Fitter, lambda model, **given: livebode.fit(livebode.example_responses(), model, **given)):
        with pytest.raises(livebode.UsageError, match="spelt_wrong"):
            call("two-mass", spelt_wrong=1)


def test_a_module_is_private_by_its_underscore() -> None:
    """No other package imports a module with an underscore."""
    files = {path for folder in (SOURCE, ROOT / "wings") for path in folder.rglob("*.py")}
    files = {path for path in files if "tests" not in path.parts}
    imports = {found for path in files for found in _imported(path)}
    private = {f"livebode.{package}.{module}" for package, module in imports if module.startswith("_")}
    assert private <= SHARED, private


def _imported(path: Path) -> Iterator[tuple[str, str]]:
    """Package and module of each import from another package of livebode."""
    own = path.relative_to(SOURCE).parts[0] if path.is_relative_to(SOURCE) else ""
    text = path.read_text("utf-8")
    for package, module in re.findall(r"livebode\.(\w+)\.(\w+)", text):
        if package != own:
            yield package, module
    for package, names in re.findall(r"from livebode\.(\w+) import ([^\n(]+|\([^)]*\))", text):
        for name in re.findall(r"\w+", names) if package != own else ():
            if (SOURCE / package / f"{name}.py").exists():
                yield package, name


def test_locks_name_no_host_and_agree_with_each_other() -> None:
    pins = [_pins(ROOT / f"requirements-{lock}.lock") for lock in ("dev", "bench", "docs", "wheels")]
    for others in pins[1:]:
        for package in pins[0].keys() & others.keys():
            assert pins[0][package] == others[package], package
    expected = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    assert {re.match(r"[a-z0-9-]+", w).group() for w in expected} <= set(pins[0])


def _pins(lock: Path) -> dict[str, set[str]]:
    """Releases of each package; several where they depend on the Python version."""
    text = lock.read_text()
    assert "://" not in text
    pins: dict[str, set[str]] = {}
    for package, release in re.findall(r"^([a-z0-9-]+)==(\S+)", text, re.M):
        pins.setdefault(package, set()).add(release)
    return pins


@pytest.mark.parametrize("package", ["livebode", *FACES])
def test_what_a_package_loads_when_it_is_used_has_the_name_of_no_module_of_it(package: str) -> None:
    """Else the module, once loaded, would be found in its place."""
    loaded = import_module(package)
    modules = {module.name for module in pkgutil.iter_modules(loaded.__path__)}
    assert set(loaded.__all__) & modules == set()
