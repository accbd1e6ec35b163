"""Install the compilers and emulators of the chips' tests where there are none: part of `make test-firmware`."""

from __future__ import annotations

import shutil

from debian_packages import install

REMEDY = "install them with the system's package manager, then run this again"
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
    if wanted:
        install(wanted, f"expected {', '.join(wanted)} for the tests of the firmware", REMEDY)


if __name__ == "__main__":
    main()
