"""One module removes files, and what is written in place is named here with its reason."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
WINGS = [path.relative_to(ROOT).as_posix() for path in sorted(ROOT.glob("wings/*/src"))]
OPENED = "open to write"
REMOVING = {"rmtree", "unlink", "rmdir", "removedirs", "truncate", "ftruncate", "rename", "renames", "rm_file", "rm"}
WRITING = {"write_text", "write_bytes", "copyfile", "copytree", "copy2", OPENED}
REMOVING_MODULES = {
    "src/livebode/core/removal.py": "the module itself",
    "src/livebode/core/files.py": "moves what was written beside its place",
    "wings/plant/src/livebode_plant/lake/table_directory.py": "objects of a storage, by the names of data files",
    "src/livebode/records/segments/disk.py": "cuts a partly written piece off a file that is the run's own",
    "tools/bundle.py": "the directory of its own earlier bundles",
    "tools/stored.py": "its own files in the environment that were not read for a week",
    "tools/wheels/__main__.py": "earlier wheels of livebode in dist/, by name",
}
"""Modules that remove or move, with the reason."""
WINGS = [path.relative_to(ROOT).as_posix() for path in sorted(ROOT.glob("wings/*/src"))]
_BESIDE, _NEW, _TEMPORARY = "a file beside its place", "a file in a new directory", "a file in a temporary directory"
WRITING_MODULES = {
    _BESIDE: (
        "cli/file_schema",
        "export/delimited", "export/lpv", "export/matrix_delimited", "export/parameters", "export/universal",
        "livebode_control/strokes/angle_table", "livebode_design/files", "livebode_design/matrix/matrix_files",
        "livebode_drives/plc_command",
        "livebode_plant/cli/archive/trend_command", "livebode_plant/lake/lake",
        "livebode_reports/files", "livebode_reports/pdf", "livebode_start/uploads", "tables/parquet_writer",
    ),
    _NEW: (
        "interface/example_recordings", "livebode_design/experiment_design",
        "livebode_plant/fleet/connection", "records/run_directory", "records/segments/segment_writer",
    ),
    _TEMPORARY: ("livebode_plant/archive/alone", "livebode_plant/fleet/server", "livebode_plant/fleet/demo"),
    "the null device": ("cli/app", "livebode_plant/archive/clusters"),
    "a lock without content": ("records/segments/lock",),
    "a file that grows, and is the run's own": ("records/segments/disk",),
}  # fmt: skip
"""Modules of hull and wings that write to a file in place, by the reason."""


@cache
def calls(path: Path) -> frozenset[str]:
    """Calls of a module that remove, move or overwrite."""
    tree = ast.parse(path.read_text("utf-8"))
    return frozenset(name for node in ast.walk(tree) if isinstance(node, ast.Call) and (name := changing(node)))


def changing(call: ast.Call) -> str:
    """Name of a call that removes, moves or overwrites a file, "" of another one."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    owner = getattr(getattr(call.func, "value", None), "id", "")
    keywords = {one.arg: getattr(one.value, "value", None) for one in call.keywords}
    values = [getattr(one, "value", None) for one in call.args] + [keywords.get("mode")]
    flags = {one.attr for one in ast.walk(call) if isinstance(one, ast.Attribute)}
    if (owner, name) == ("os", "open"):
        return OPENED if flags & {"O_WRONLY", "O_RDWR", "O_TRUNC"} else ""
    if name == "open":
        modes = [set(one) for one in values if isinstance(one, str)]
        return OPENED if any(one <= set("wabt+") and one & set("wa+") for one in modes) else ""
    if name == "vacuum":
        return "" if keywords.get("dry_run") is True else name
    if name in ("remove", "replace", "move"):  # also methods of lists, texts and arrays
        of_a_path = name == "replace" and isinstance(call.func, ast.Attribute) and len(call.args) == 1 and not keywords
        return name if owner in ("os", "shutil") or of_a_path else ""
    return name if name in REMOVING | WRITING else ""


def modules(*folders: str) -> list[Path]:
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def test_no_other_module_removes_or_moves_a_file() -> None:
    found = {
        path.relative_to(ROOT).as_posix()
        for path in modules("src/livebode", *WINGS, "tools", "examples")
        if calls(path) - WRITING
    }
    assert found == set(REMOVING_MODULES)


def test_every_other_file_is_written_whole() -> None:
    found = {
        path.relative_to(ROOT / source).with_suffix("").as_posix()
        for source in ("src/livebode", *WINGS)
        for path in modules(source)
        if set(calls(path)) & WRITING
    }
    assert found - {"core/files"} == {name for names in WRITING_MODULES.values() for name in names}
