"""Install the compilers and emulators of the chips' tests where there are none: part of `make test-firmware`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

from install_browser import as_root

PROGRAMS = {
    "gcc": "gcc",
    "clang": "clang",
    "arm-none-eabi-gcc": "gcc-arm-none-eabi libnewlib-arm-none-eabi",
    "riscv64-unknown-elf-gcc": "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf",
    "qemu-system-arm": "qemu-system-arm",
    "qemu-system-riscv32": "qemu-system-misc",
}


def lacking() -> list[str]:
    """Debian's packages of what is not there."""
    return [
        package for program, packages in PROGRAMS.items() if not shutil.which(program) for package in packages.split()
    ]


def main() -> None:
    """Install what is lacking."""
    wanted = lacking()
    if not wanted:
        return
    refusal = f"expected {', '.join(wanted)} for the tests of the firmware"
    before, apt = as_root(), shutil.which("apt-get")
    if before is None or apt is None:
        sys.exit(f"{refusal}: install them with the system's package manager, then run this again")
    settings = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for words in (["update"], ["install", "--yes", "--no-install-recommends", *wanted]):
        done = subprocess.run(
            [*before, apt, "--quiet=2", *words], env=settings, capture_output=True, text=True, check=False
        )
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no reason"])[-1]
            sys.exit(f"{refusal}: apt-get {words[0]}: {last}")


if __name__ == "__main__":
    main()
