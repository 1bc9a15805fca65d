"""For which platforms a package has a wheel: `python -m bench.decisions.wheels [PACKAGE …]` asks the registry.

Without names: the packages with compiled parts that livebode always needs.
"""

from __future__ import annotations

import subprocess
import sys

COMPILED = ["numpy", "scipy", "matplotlib", "pyarrow", "pydantic-core", "plotext>=6.1", "plotille"]
PLATFORMS = {
    "Linux x86_64": ["manylinux2014_x86_64", "manylinux_2_17_x86_64", "manylinux_2_27_x86_64", "manylinux_2_28_x86_64"],
    "Linux aarch64": [
        "manylinux2014_aarch64", "manylinux_2_17_aarch64", "manylinux_2_27_aarch64", "manylinux_2_28_aarch64",
    ],
    "Linux ARMv7": ["manylinux2014_armv7l", "manylinux_2_17_armv7l", "manylinux_2_31_armv7l", "manylinux_2_35_armv7l"],
    "musl x86_64": ["musllinux_1_1_x86_64", "musllinux_1_2_x86_64"],
    "musl aarch64": ["musllinux_1_1_aarch64", "musllinux_1_2_aarch64"],
    "macOS arm64": ["macosx_11_0_arm64", "macosx_12_0_arm64", "macosx_14_0_arm64"],
    "Windows x86_64": ["win_amd64"],
    "Windows arm64": ["win_arm64"],
}  # fmt: skip


def has_wheel(package: str, tags: list[str]) -> bool:
    asked = [
        sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--ignore-installed", "--no-deps", "--target",
        "none", "--only-binary=:all:", "--python-version", "3.12", "--implementation", "cp", "--abi", "cp312", "--abi",
        "abi3", "--abi", "none", *(word for tag in tags for word in ("--platform", tag)), package,
    ]  # fmt: skip
    return subprocess.run(asked, capture_output=True, check=False).returncode == 0


def main() -> None:
    packages = sys.argv[1:] or COMPILED
    print(f"{'':16}" + "".join(f"{package:>15}" for package in packages))
    for name, tags in PLATFORMS.items():
        found = ["wheel" if has_wheel(package, tags) else "-" for package in packages]
        print(f"{name:16}" + "".join(f"{cell:>15}" for cell in found), flush=True)


if __name__ == "__main__":
    main()
